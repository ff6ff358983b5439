package heptarm.fake;

import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.List;

import heptarm.core.Clock;
import heptarm.core.CommandRejected;
import heptarm.core.Threads;
import heptarm.core.checks.Conditions;
import heptarm.core.robot.FriSession;
import heptarm.core.robot.MotionJob;
import heptarm.core.robot.MotionPort;
import heptarm.core.robot.Sensors;
import heptarm.core.robot.ServoJob;
import heptarm.core.robot.SignalPort;
import heptarm.core.state.ConditionReadings;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.FriCommandMode;
import heptarm.wire.FriOpen;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;
import heptarm.wire.HandGuide;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointImpedance;
import heptarm.wire.Mode;
import heptarm.wire.PathReached;
import heptarm.wire.PathReference;
import heptarm.wire.Ptp;
import heptarm.wire.PtpHome;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;
import heptarm.wire.SignalOutside;
import heptarm.wire.Trigger;

/**
 * Seven axes without dynamics: each motion runs at one speed, a cancelled one stops at once.
 *
 * <p>The target of A7 orders failures of a PTP: 1.25 rad fails at planning, 1.5 rad fails during the motion, 1.0 rad is
 * planned until the operator orders "planned", 0.75 rad needs an option that the cabinet lacks, the check of 0.875 rad takes 0.6 s. A servo motion jumps to its targets; it refuses more than
 * 2 rad of A7, and ends 0.3 s after the last target. Only the engine lin follows poses, and turns A7 by their x.
 */
final class FakeMotions implements MotionPort, Runnable {
    private static final double SPEED = 1.0;
    private static final double FAILS_AT_PLANNING = 1.25;
    private static final double FAILS_IN_MOTION = 1.5;
    private static final double PLANS_SLOWLY = 1.0;
    private static final double LACKS_A_CLASS = 0.75;
    private static final double CHECKED_SLOWLY = 0.875;
    private static final long CHECK_NS = 600000000L;
    private static final double REFUSED_TARGET = 2.0;
    private static final double SERVO_TIMEOUT = 0.3;
    private static final int TAKEN_PORT = 1;
    private static final int SLOW_PORT = 2;
    private static final double NEVER_ANSWERS = 0.1;
    private static final double FAILS_COMMANDING = 0.009;
    private static final double ENDLESS = 1e9;
    private static final long TICK_NS = 2000000L;
    private static final Conditions.Tree[] NONE = {};

    private final FakeFaults faults;
    private final Clock clock;
    private final FakeSafety safety;
    private final Sensors sensors;
    private final SignalPort signals;
    private final double[] q;
    private final ArrayDeque<FakeJob> jobs = new ArrayDeque<>();
    private volatile double override = 1.0;

    /** Joint positions: shared with the sensors, guarded by themselves. */
    FakeMotions(FakeFaults faults, FakeSafety safety, Sensors sensors, SignalPort signals, double[] q) {
        this.faults = faults;
        this.clock = faults.clock;
        this.safety = safety;
        this.sensors = sensors;
        this.signals = signals;
        this.q = q;
    }

    private final class FakeJob implements ServoJob {
        final MotionJob.Listener listener;
        double[] target;
        double left;
        Conditions.Tree[] until = NONE;
        Trigger[] triggers = {};
        boolean[] reported = {};
        double[] from;
        boolean isServo;
        boolean isLin;
        String failure = "";
        boolean started;
        boolean cancelled;
        boolean stopped;

        FakeJob(double[] target, double seconds, MotionJob.Listener listener) {
            this.target = target;
            this.left = seconds;
            this.listener = listener;
        }

        @Override
        public void follow(double[] to, double[] velocity) throws CommandRejected {
            if (Math.abs(to[6]) > REFUSED_TARGET) {
                throw new CommandRejected(Code.EXECUTION_FAILED, "the robot refuses this target");
            }
            synchronized (q) {
                target = to;
                left = SERVO_TIMEOUT;
            }
        }

        @Override
        public void followPose(double[] xyz, double[] quat) throws CommandRejected {
            if (!isLin) {
                throw new CommandRejected(Code.UNREACHABLE, "not reachable");
            }
            follow(new double[] {0, 0, 0, 0, 0, 0, xyz[0]}, null);
        }

        @Override
        public void changeMode(Mode to) {
        }

        @Override
        public void cancel() {
            faults.command();
            synchronized (q) {
                cancelled = true;
            }
        }

        MotionJob.Outcome move(double dt) {
            if (target == null || isServo) {
                left -= dt;
                if (target != null) {
                    System.arraycopy(target, 0, q, 0, 7);
                }
                return left > 0 ? null : failure.isEmpty() ? MotionJob.Outcome.DONE : MotionJob.Outcome.FAILED;
            }
            boolean arrived = true;
            for (int i = 0; i < 7; i++) {
                q[i] += Math.max(-SPEED * dt, Math.min(SPEED * dt, target[i] - q[i]));
                arrived &= q[i] == target[i];
            }
            if (target[6] == FAILS_IN_MOTION && q[6] > 0.1) {
                failure = "the drive of A7 tripped";
                return MotionJob.Outcome.FAILED;
            }
            return arrived ? MotionJob.Outcome.DONE : null;
        }

        /** The path is measured in radians of the axis with the largest displacement. */
        boolean isTrue(Trigger trigger) {
            Conditions.Tree tree = Conditions.tree(trigger.condition);
            if (!(tree.node instanceof PathReached point)) {
                return readings().first(new Conditions.Tree[] {tree}) != null;
            }
            double travelled = 0.0;
            double length = 0.0;
            for (int i = 0; i < 7; i++) {
                travelled = Math.max(travelled, Math.abs(q[i] - from[i]));
                length = Math.max(length, Math.abs(target[i] - from[i]));
            }
            return travelled >= (point.reference == PathReference.START ? 0.0 : length) + point.distance - 1e-9;
        }
    }

    private ConditionReadings readings() {
        return new ConditionReadings(sensors, signals, clock.nanos());
    }

    @Override
    public void run() {
        try {
            long next = clock.nanos();
            while (true) {
                next = clock.sleepUntil(next + TICK_NS);
                tick(TICK_NS * 1e-9 * (safety.paused ? 0.0 : override));
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private void tick(double dt) {
        FakeJob job;
        boolean begins = false;
        int node = -1;
        MotionJob.Outcome outcome = null;
        List<Integer> triggered = new ArrayList<>();
        synchronized (q) {
            job = jobs.peek();
            if (job == null) {
                return;
            }
            if (job.cancelled || job.stopped) { // as of a container, whose job knows only whether it was cancelled itself
                outcome = job.cancelled ? MotionJob.Outcome.CANCELLED : MotionJob.Outcome.DONE;
            } else if (!job.started && safety.isStopped()) {
                return;
            } else {
                begins = !job.started;
                job.started = true;
                job.from = begins ? q.clone() : job.from;
                Conditions.Tree fired = readings().first(job.until);
                outcome = fired == null ? job.move(dt) : MotionJob.Outcome.CONDITION;
                node = fired == null ? -1 : fired.index;
                for (int i = 0; i < job.triggers.length; i++) {
                    if (!job.reported[i] && job.isTrue(job.triggers[i])) {
                        job.reported[i] = true;
                        triggered.add(i);
                    }
                }
            }
            if (outcome != null) {
                jobs.poll();
            }
        }
        if (begins) {
            job.listener.started();
        }
        triggered.forEach(job.listener::triggered);
        if (node >= 0) {
            job.listener.fired(node);
        }
        if (outcome == MotionJob.Outcome.FAILED) {
            job.listener.finished(outcome, Code.EXECUTION_FAILED, job.failure);
        } else if (outcome != null) {
            job.listener.finished(outcome, 0, "");
        }
    }

    private FakeJob add(FakeJob job) {
        synchronized (q) {
            jobs.add(job);
        }
        return job;
    }

    @Override
    public void check(Item item, String path) throws CommandRejected {
        if (!(item.motion instanceof Ptp || item.motion instanceof PtpHome || item.motion instanceof Hold
                || item.motion instanceof HandGuide)) {
            throw new CommandRejected(Code.UNSUPPORTED, path + "motion", item.motion.getClass().getSimpleName(), "Ptp, Hold, HandGuide",
                    "not here");
        }
        if (item.motion instanceof Ptp ptp && ptp.q[6] == CHECKED_SLOWLY) {
            faults.sleep(CHECK_NS);
        }
    }

    @Override
    public MotionJob start(Item item, Mode mode, MotionJob.Listener listener) throws CommandRejected {
        double[] target = item.motion instanceof Ptp ptp ? ptp.q : item.motion instanceof PtpHome ? new double[7] : null;
        double order = target == null ? 0.0 : target[6];
        if (order == FAILS_AT_PLANNING) {
            throw new CommandRejected(Code.UNREACHABLE, "Can not plan motion: not reachable");
        } else if (order == LACKS_A_CLASS) {
            throw new NoClassDefFoundError("com/kuka/Option");
        } else if (order == PLANS_SLOWLY) {
            faults.plan();
        }
        double seconds = item.motion instanceof Hold hold ? hold.duration : ENDLESS;
        FakeJob job = new FakeJob(target, Double.isNaN(seconds) ? ENDLESS : seconds, listener);
        job.triggers = item.triggers;
        job.reported = new boolean[item.triggers.length];
        if (monitors(item.until) && !(item.motion instanceof HandGuide)) {
            job.until = Conditions.alternatives(item.until);
        }
        return add(job);
    }

    /** The members run one after the other and are cancelled together. */
    @Override
    public MotionJob start(Item[] batch, Mode mode, MotionJob.Listener[] listeners) throws CommandRejected {
        MotionJob[] members = new MotionJob[batch.length];
        for (int i = 0; i < batch.length; i++) {
            members[i] = start(batch[i], mode, listeners[i]);
        }
        return () -> {
            for (int i = members.length - 1; i >= 0; i--) {
                members[i].cancel();
            }
        };
    }

    /** The core monitors number signals. */
    @Override
    public boolean monitors(Condition condition) {
        return !Conditions.contains(condition, SignalOutside.class);
    }

    @Override
    public void check(ServoOpen open) {
    }

    @Override
    public ServoJob openServo(ServoOpen open, MotionJob.Listener listener) {
        FakeJob job = new FakeJob(null, SERVO_TIMEOUT, listener);
        job.isServo = true;
        job.isLin = open.engine == ServoEngine.LIN;
        faults.stiffness = open.mode instanceof JointImpedance impedance ? impedance.stiffness[0] : 0.0;
        return add(job);
    }

    @Override
    public void check(FriOpen open) throws CommandRejected {
        if (open.command == FriCommandMode.POSE) {
            throw new CommandRejected(Code.UNSUPPORTED, "command", "pose", "", "not here");
        }
        if (open.port == SLOW_PORT) {
            faults.sleep(CHECK_NS);
        }
    }

    /** The check of port 2 takes 0.6 s. Its client answers after ten times the period, unless that is 0.1 s; a commanding one of 9 ms fails soon. */
    @Override
    public FriSession openFri(FriOpen open, FriSession.Listener listener) throws CommandRejected {
        if (open.port == TAKEN_PORT) {
            throw new CommandRejected(Code.EXECUTION_FAILED, "port " + open.port + " is taken");
        }
        listener.changed(FriSessionState.MONITORING_WAIT, FriQuality.POOR);
        if (open.period < NEVER_ANSWERS) {
            Threads.start("fake-fri", () -> {
                faults.sleep((long) (open.period * 1e10));
                listener.changed(FriSessionState.MONITORING_READY, FriQuality.GOOD);
            });
        }
        return new FriSession() {
            @Override
            public MotionJob command(MotionJob.Listener jobListener) {
                listener.changed(FriSessionState.COMMANDING_WAIT, FriQuality.GOOD);
                FakeJob job = new FakeJob(null, open.period == FAILS_COMMANDING ? 0.1 : ENDLESS, jobListener);
                job.failure = "illegal axis delta";
                return add(job);
            }

            @Override
            public void close() {
            }
        };
    }

    @Override
    public void stop() {
        faults.command();
        synchronized (q) {
            jobs.forEach(job -> job.stopped = true);
        }
    }

    @Override
    public void stopFast() {
        stop();
    }

    @Override
    public void pause() {
        safety.paused = true;
    }

    @Override
    public void resume() {
        safety.paused = false;
    }

    @Override
    public void setOverride(double value) {
        override = value;
    }

    @Override
    public double override() {
        return override;
    }
}
