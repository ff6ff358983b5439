package heptarm.fake;

import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;

import heptarm.core.Clock;
import heptarm.core.Conditions;
import heptarm.core.Fri;
import heptarm.core.Job;
import heptarm.core.Models;
import heptarm.core.Readings;
import heptarm.core.Refusal;
import heptarm.core.Robot;
import heptarm.core.Servo;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.FrameInfo;
import heptarm.wire.FriCommandMode;
import heptarm.wire.FriOpen;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;
import heptarm.wire.HandGuide;
import heptarm.wire.Hold;
import heptarm.wire.IoDirection;
import heptarm.wire.IoType;
import heptarm.wire.Item;
import heptarm.wire.Mode;
import heptarm.wire.OperationMode;
import heptarm.wire.PathReached;
import heptarm.wire.PathReference;
import heptarm.wire.Pose;
import heptarm.wire.PoseState;
import heptarm.wire.Ptp;
import heptarm.wire.PtpHome;
import heptarm.wire.Redundancy;
import heptarm.wire.RobotInfo;
import heptarm.wire.SafetyBits;
import heptarm.wire.SafetyState;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;
import heptarm.wire.SetKey;
import heptarm.wire.SignalInfo;
import heptarm.wire.SignalOutside;
import heptarm.wire.ToolInfo;
import heptarm.wire.Trigger;
import heptarm.wire.WrenchState;

/**
 * Seven axes without dynamics: each motion runs at one speed, a cancelled one rests at once.
 *
 * <p>Errors to order: a PTP whose A7 is 1.25 rad fails when it is planned, one with 1.5 rad fails on the way, and one with
 * 1.0 rad is planned for two seconds. One with 0.75 rad needs an option that
 * the cabinet lacks. A servo motion goes straight to its targets; one to more than 2 rad of A7 is refused by the robot,
 * and after 0.3 s without a target it ends by itself. Of poses it follows those of the engine lin only, and turns A7 by their x.
 * After the message "blind" readings fail for a while, after "jammed" cancelling and writing do.
 */
final class FakeRobot implements Robot, Runnable {
    static final double SPEED = 1.0;
    static final double FAILS_AT_PLANNING = 1.25;
    static final double FAILS_ON_THE_WAY = 1.5;
    static final double PLANS_SLOWLY = 1.0;
    static final double LACKS_A_CLASS = 0.75;
    static final int NO_PORT = 1;
    static final double NEVER = 0.1;
    static final double FAILS_COMMANDING = 0.009;
    static final double REFUSED = 2.0;
    static final double SERVO_TIMEOUT = 0.3;
    static final double UNLUCKY = 13.0;
    static final double SPRING = 10.0;
    static final double INACCURACY = 0.5;
    static final SignalInfo[] SIGNALS = {
        new SignalInfo("Flange.Button", IoDirection.INPUT, IoType.BOOLEAN, 0, 1),
        new SignalInfo("Flange.Lamp", IoDirection.OUTPUT, IoType.BOOLEAN, 0, 1),
        new SignalInfo("Cell.Count", IoDirection.OUTPUT, IoType.UNSIGNED, 0, 255),
        new SignalInfo("Cell.Level", IoDirection.OUTPUT, IoType.ANALOG, -10, 10),
        new SignalInfo("Cell.Offset", IoDirection.INPUT, IoType.INTEGER, -128, 127),
    };
    private static final long SLOWLY_NS = 2000000000L;
    private static final long FAULT_NS = 1500000000L;
    private static final long TICK_NS = 2000000L;

    private final Clock clock;
    private final long getterNanos;
    private final double[] q = new double[7];
    private final ArrayDeque<FakeJob> jobs = new ArrayDeque<>();
    private final double[] signals = new double[SIGNALS.length];
    private final RobotInfo info;
    private volatile double override = 1.0;
    private volatile double speed = 0.5;
    private volatile String keyed = "";
    private volatile boolean paused;
    private volatile int safety;
    private volatile OperationMode operation = OperationMode.AUT;
    private volatile long blindUntil;
    private volatile long jammedUntil;

    FakeRobot(Clock clock, long getterNanos) {
        this.clock = clock;
        this.getterNanos = getterNanos;
        double[] limit = {2.96, 2.09, 2.96, 2.09, 2.96, 2.09, 3.05};
        double[] low = new double[7];
        for (int i = 0; i < 7; i++) {
            low[i] = -limit[i];
        }
        this.info = Models.describe("LBR_iiwa_14_R820_1", low, limit);
    }

    private final class FakeJob implements Servo {
        double[] target;
        final double seconds;
        final Job.Listener listener;
        Conditions.Tree[] until = new Conditions.Tree[0];
        Trigger[] triggers = {};
        boolean[] told = {};
        double[] from;
        boolean follows;
        boolean straight;
        boolean started;
        boolean cancelled;
        double left;

        FakeJob(double[] target, double seconds, Job.Listener listener) {
            this.target = target;
            this.seconds = seconds;
            this.left = seconds;
            this.listener = listener;
        }

        @Override
        public void follow(double[] to, double[] velocity) throws Refusal {
            if (Math.abs(to[6]) > REFUSED) {
                throw new Refusal(Code.EXECUTION_FAILED, "the robot does not want to go there");
            }
            synchronized (jobs) {
                target = to;
                left = SERVO_TIMEOUT;
            }
        }

        @Override
        public void followPose(double[] xyz, double[] quat) throws Refusal {
            if (!straight) {
                throw new Refusal(Code.UNREACHABLE, "not reachable");
            }
            follow(new double[] {0, 0, 0, 0, 0, 0, xyz[0]}, null);
        }

        @Override
        public void change(Mode to) {
        }

        @Override
        public void cancel() {
            fail(jammedUntil);
            synchronized (jobs) {
                cancelled = true;
            }
        }
    }

    @Override
    public void run() {
        try {
            long next = clock.nanos();
            while (true) {
                next = clock.sleepUntil(next + TICK_NS);
                tick(TICK_NS * 1e-9 * (paused ? 0.0 : override));
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private void tick(double dt) {
        FakeJob job;
        boolean begins = false;
        int node = -1;
        Job.Ended ended = null;
        List<Integer> triggered = new ArrayList<>();
        synchronized (jobs) {
            job = jobs.peek();
            if (job == null) {
                return;
            }
            if (job.cancelled) {
                ended = Job.Ended.CANCELLED;
            } else if (!job.started && isStopped()) {
                return;
            } else {
                begins = !job.started;
                job.started = true;
                if (begins) {
                    job.from = q.clone();
                }
                Conditions.Tree fired = new Readings(this, clock.nanos()).first(job.until);
                ended = fired == null ? move(job, dt) : Job.Ended.CONDITION;
                node = fired == null ? -1 : fired.index;
                for (int i = 0; i < job.triggers.length; i++) {
                    if (!job.told[i] && holds(job, job.triggers[i])) {
                        job.told[i] = true;
                        triggered.add(i);
                    }
                }
            }
            if (ended != null) {
                jobs.poll();
            }
        }
        if (begins) {
            job.listener.started();
        }
        for (int trigger : triggered) {
            job.listener.triggered(trigger);
        }
        if (node >= 0) {
            job.listener.fired(node);
        }
        if (ended == Job.Ended.FAILED) {
            job.listener.finished(ended, Code.EXECUTION_FAILED, "the drive of A7 tripped");
        } else if (ended != null) {
            job.listener.finished(ended, 0, "");
        }
    }

    /** Its metres are radians of the axis that has farthest to go. */
    private boolean holds(FakeJob job, Trigger trigger) {
        Conditions.Tree tree = Conditions.tree(trigger.condition);
        if (!(tree.node instanceof PathReached)) {
            return new Readings(this, clock.nanos()).first(new Conditions.Tree[] {tree}) != null;
        }
        double way = 0.0;
        double all = 0.0;
        for (int i = 0; i < 7; i++) {
            way = Math.max(way, Math.abs(q[i] - job.from[i]));
            all = Math.max(all, Math.abs(job.target[i] - job.from[i]));
        }
        PathReached point = (PathReached) tree.node;
        return way >= (point.reference == PathReference.START ? 0.0 : all) + point.distance - 1e-9;
    }

    private Job.Ended move(FakeJob job, double dt) {
        if (job.follows) {
            job.left -= dt;
            if (job.target != null) {
                System.arraycopy(job.target, 0, q, 0, 7);
            }
            return job.left <= 0 ? Job.Ended.DONE : null;
        }
        if (job.target == null) {
            job.left -= dt;
            return job.left <= 0 ? Job.Ended.DONE : null;
        }
        boolean arrived = true;
        for (int i = 0; i < 7; i++) {
            double step = Math.max(-SPEED * dt, Math.min(SPEED * dt, job.target[i] - q[i]));
            q[i] += step;
            arrived &= q[i] == job.target[i];
        }
        if (job.target[6] == FAILS_ON_THE_WAY && q[6] > 0.1) {
            return Job.Ended.FAILED;
        }
        return arrived ? Job.Ended.DONE : null;
    }

    private void fail(long until) {
        if (clock.nanos() < until) {
            throw new IllegalStateException("the controller did not respond");
        }
    }

    /** Each getter of a cabinet costs. */
    private void pay(int getters) {
        fail(blindUntil);
        if (getterNanos > 0) {
            sleep(getters * getterNanos);
        }
    }

    private void sleep(long nanos) {
        try {
            clock.sleepUntil(clock.nanos() + nanos);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    @Override
    public Job start(Item item, Mode mode, Job.Listener listener) throws Refusal {
        double[] target = item.motion instanceof Ptp ? ((Ptp) item.motion).q : item.motion instanceof PtpHome ? new double[7] : null;
        if (target != null && target[6] == FAILS_AT_PLANNING) {
            throw new Refusal(Code.UNREACHABLE, "Can not plan motion: not reachable");
        }
        if (target != null && target[6] == LACKS_A_CLASS) {
            throw new NoClassDefFoundError("com/kuka/Option");
        }
        if (target != null && target[6] == PLANS_SLOWLY) {
            sleep(SLOWLY_NS);
        }
        double seconds = item.motion instanceof Hold ? ((Hold) item.motion).duration : item.motion instanceof HandGuide ? 1e9 : 0.0;
        FakeJob job = new FakeJob(target, Double.isNaN(seconds) ? 1e9 : seconds, listener);
        job.triggers = item.triggers;
        job.told = new boolean[item.triggers.length];
        job.until = watches(item.until) && !(item.motion instanceof HandGuide) ? Conditions.alternatives(item.until) : new Conditions.Tree[0];
        synchronized (jobs) {
            jobs.add(job);
        }
        return job;
    }

    /** Its members run one after the other and are cancelled together. */
    @Override
    public Job start(Item[] batch, Mode mode, Job.Listener[] listeners) throws Refusal {
        Job[] members = new Job[batch.length];
        for (int i = 0; i < batch.length; i++) {
            members[i] = start(batch[i], mode, listeners[i]);
        }
        return () -> {
            for (int i = members.length - 1; i >= 0; i--) {
                members[i].cancel();
            }
        };
    }

    @Override
    public void check(FriOpen open) throws Refusal {
        if (open.command == FriCommandMode.POSE) {
            throw new Refusal(Code.UNSUPPORTED, "command", "pose", "", "not here");
        }
    }

    /** Its client answers after the period's time, in milliseconds times ten; one of 0.1 s never answers. */
    @Override
    public Fri fri(FriOpen open, Fri.Listener listener) throws Refusal {
        if (open.port == NO_PORT) {
            throw new Refusal(Code.EXECUTION_FAILED, "port " + open.port + " is taken");
        }
        listener.changed(FriSessionState.MONITORING_WAIT, FriQuality.POOR);
        if (open.period < NEVER) {
            Thread client = new Thread(() -> {
                sleep((long) (open.period * 1e10));
                listener.changed(FriSessionState.MONITORING_READY, FriQuality.GOOD);
            });
            client.setDaemon(true);
            client.start();
        }
        return new Fri() {
            @Override
            public Job command(Job.Listener jobListener) {
                listener.changed(FriSessionState.COMMANDING_WAIT, FriQuality.GOOD);
                FakeJob job = new FakeJob(null, open.period == FAILS_COMMANDING ? 0.1 : 1e9, new Job.Listener() {
                    @Override
                    public void started() {
                        jobListener.started();
                    }

                    @Override
                    public void reached(int segment) {
                        jobListener.reached(segment);
                    }

                    @Override
                    public void triggered(int trigger) {
                        jobListener.triggered(trigger);
                    }

                    @Override
                    public void fired(int node) {
                        jobListener.fired(node);
                    }

                    @Override
                    public void finished(Job.Ended how, int code, String text) {
                        boolean bad = how == Job.Ended.DONE;
                        jobListener.finished(bad ? Job.Ended.FAILED : how, bad ? Code.EXECUTION_FAILED : 0,
                                bad ? "illegal axis delta" : "");
                    }
                });
                synchronized (jobs) {
                    jobs.add(job);
                }
                return job;
            }

            @Override
            public void close() {
            }
        };
    }

    @Override
    public void check(ServoOpen open) throws Refusal {
    }

    @Override
    public Servo servo(ServoOpen open, Job.Listener listener) {
        FakeJob job = new FakeJob(null, SERVO_TIMEOUT, listener);
        job.follows = true;
        job.straight = open.engine == ServoEngine.LIN;
        synchronized (jobs) {
            jobs.add(job);
        }
        return job;
    }

    @Override
    public void check(Item item, String path) throws Refusal {
        if (!(item.motion instanceof Ptp || item.motion instanceof PtpHome || item.motion instanceof Hold
                || item.motion instanceof HandGuide)) {
            throw new Refusal(Code.UNSUPPORTED, path + "motion", item.motion.getClass().getSimpleName(), "Ptp, Hold, HandGuide",
                    "not here");
        }
    }

    @Override
    public void readJoints(double[] measured, double[] commanded) {
        pay(2);
        synchronized (jobs) {
            System.arraycopy(q, 0, measured, 0, 7);
            System.arraycopy(q, 0, commanded, 0, 7);
        }
    }

    @Override
    public void readTorques(double[] measured, double[] external, double[] commanded) {
        pay(2);
        Arrays.fill(commanded, Double.NaN);
        external[6] = torque();
    }

    /** A spring at A7: the further it turns, the more it is pushed. */
    private double torque() {
        synchronized (jobs) {
            return -SPRING * q[6];
        }
    }

    /** The same spring pushes along the axis of the flange, which lies in x of the base. */
    @Override
    public WrenchState readWrench(String axes, long stamp) {
        double[] force = new double[3];
        force["base".equals(axes) ? 0 : 2] = torque();
        return new WrenchState(stamp, force, new double[3], new double[] {INACCURACY, 0, 0}, new double[3]);
    }

    @Override
    public void readSignals(double[] values, int from, int count) {
        pay(count);
        synchronized (signals) {
            System.arraycopy(signals, from, values, from, count);
        }
    }

    @Override
    public void writeSignals(int[] places, double[] values) {
        fail(jammedUntil);
        synchronized (signals) {
            for (int i = 0; i < places.length; i++) {
                signals[places[i]] = values[i];
            }
        }
    }

    /** It has three keys. */
    @Override
    public void setKey(SetKey key) throws Refusal {
        if (key.slot == 3) {
            throw new Refusal(Code.UNSUPPORTED, "this cabinet has three user keys");
        }
        keyed = key.slot + " " + key.text + " " + key.led + " " + key.enabled;
    }

    @Override
    public String processData(String name) throws Refusal {
        if ("keyed".equals(name)) {
            return keyed;
        }
        if (!"speed".equals(name)) {
            throw new Refusal(Code.UNKNOWN_NAME, "name", name, "", "no process data " + name);
        }
        return Double.toString(speed);
    }

    @Override
    public void setProcessData(String name, String value) throws Refusal {
        processData(name);
        try {
            speed = Double.parseDouble(value);
        } catch (NumberFormatException e) {
            throw new Refusal(Code.OUT_OF_RANGE, "value", value, "a number", value + " is no number");
        }
    }

    /** Number signals are the core's business. */
    @Override
    public boolean watches(Condition condition) {
        return !Conditions.contains(condition, SignalOutside.class);
    }

    @Override
    public PoseState readPose(long stamp) {
        pay(2);
        double[] xyz = {0.5, 0.0, 0.5};
        double[] quat = {0.0, 0.0, 0.0, 1.0};
        return new PoseState(stamp, xyz, quat, xyz, quat, new Redundancy(0.0, 2, 0));
    }

    @Override
    public WrenchState readWrench(long stamp) {
        pay(1);
        return new WrenchState(stamp, new double[3], new double[3], new double[3], new double[3]);
    }

    @Override
    public SafetyState readSafety(long stamp) {
        pay(6);
        int bits = safety | SafetyBits.MASTERED | (paused ? SafetyBits.PAUSED : 0);
        return new SafetyState(stamp, isStopped() ? bits : bits | SafetyBits.READY_TO_MOVE, operation);
    }

    @Override
    public void readProgress(double[] progressAndRemaining) {
        Arrays.fill(progressAndRemaining, Double.NaN);
    }

    @Override
    public void stop() {
        fail(jammedUntil);
        synchronized (jobs) {
            for (FakeJob job : jobs) {
                job.cancelled = true;
            }
        }
    }

    @Override
    public void pause() {
        paused = true;
    }

    @Override
    public void resume() {
        paused = false;
    }

    @Override
    public void setOverride(double value) {
        override = value;
    }

    @Override
    public double override() {
        return override;
    }

    @Override
    public void stopFast() {
        stop();
    }

    /** Acknowledges a safety stop that nobody has to lift. */
    @Override
    public void recover() {
        safety &= ~SafetyBits.PROTECTIVE_STOP;
        paused = false;
    }

    private boolean isStopped() {
        return safety != 0 && safety != SafetyBits.ENABLING_SWITCH || operation != OperationMode.AUT && safety == 0;
    }

    /** What happens at the smartPAD; a stop pauses, as on the cabinet. */
    private void operate(String what) {
        if ("operator: emergency stop".equals(what)) {
            safety = SafetyBits.EMERGENCY_STOP | SafetyBits.PROTECTIVE_STOP;
        } else if ("operator: safeguard".equals(what)) {
            safety = SafetyBits.OPERATOR_SAFETY_OPEN | SafetyBits.PROTECTIVE_STOP;
        } else if ("operator: safety stop".equals(what)) {
            safety = SafetyBits.PROTECTIVE_STOP;
        } else if ("operator: release".equals(what)) {
            safety = 0;
        } else if ("operator: enable".equals(what)) {
            safety = SafetyBits.ENABLING_SWITCH;
        } else if ("operator: T1".equals(what)) {
            operation = OperationMode.T1;
        } else {
            operation = OperationMode.AUT;
        }
        paused = paused || safety != SafetyBits.ENABLING_SWITCH;
    }

    @Override
    public void show(int severity, String text) {
        if (text.startsWith("operator: ")) {
            operate(text);
            return;
        }
        long until = clock.nanos() + FAULT_NS;
        if ("blind".equals(text)) {
            blindUntil = until;
        }
        if ("jammed".equals(text)) {
            jammedUntil = until;
        }
        if ("lacking".equals(text)) {
            throw new NoClassDefFoundError("com/kuka/Option");
        }
        if ("crash".equals(text)) {
            throw new IllegalStateException("an error of the cabinet's API");
        }
    }

    @Override
    public RobotInfo info() {
        return info;
    }

    @Override
    public String cabinet() {
        return "fake";
    }

    @Override
    public boolean isVirtual() {
        return true;
    }

    @Override
    public String[] capabilities() {
        return new String[] {"ptp", "hold"};
    }

    @Override
    public ToolInfo[] tools() {
        return new ToolInfo[] {template("listed")};
    }

    /** The project has two templates, one of whose names the robot knows. */
    @Override
    public ToolInfo template(String name) {
        if (!"listed".equals(name) && !"hidden".equals(name)) {
            return null;
        }
        Pose tip = new Pose(new double[] {0.0, 0.0, 0.1}, new double[] {0.0, 0.0, 0.0, 1.0});
        return new ToolInfo(name, 1.0, new double[3], new double[6], new FrameInfo[] {new FrameInfo("tip", tip)});
    }

    /** A tool of 13 kg falls off. */
    @Override
    public void attach(ToolInfo tool, String moved) throws Refusal {
        if (tool != null && tool.mass == UNLUCKY) {
            throw new Refusal(Code.EXECUTION_FAILED, "it does not hold");
        }
    }

    @Override
    public void load(ToolInfo workpiece) throws Refusal {
        attach(workpiece, "");
    }

    @Override
    public FrameInfo[] frames() {
        Pose there = new Pose(new double[] {0.5, 0.0, 0.0}, new double[] {0.0, 0.0, 0.0, 1.0});
        return new FrameInfo[] {new FrameInfo("/table", there)};
    }

    @Override
    public SignalInfo[] signals() {
        return SIGNALS;
    }
}
