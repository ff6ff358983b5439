package heptarm.core;

import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;

import heptarm.wire.Groups;
import heptarm.wire.IoState;
import heptarm.wire.JointState;
import heptarm.wire.ModeState;
import heptarm.wire.MotionState;
import heptarm.wire.PoseState;
import heptarm.wire.SafetyState;
import heptarm.wire.State;
import heptarm.wire.TorqueState;
import heptarm.wire.WrenchState;

/**
 * Samples the robot's state in groups, each with its own stamp, and hands every subscriber its frames when they are due.
 *
 * <p>A slow getter of the robot never stands in the way of a command, because this thread reads state and no other one waits
 * for it. It works on the clock's grid: a late wake-up is caught up state by state, unless it is too late by far. A group
 * whose reading is slow is read less often than it is pushed; it then comes again with its old stamp.
 */
final class Sampler {
    /** Time constant of the velocity's low-pass filter [s]. */
    private static final double FILTER = 0.01;
    private static final long IDLE_NS = 20000000L;
    private static final int TOO_LATE = 50;

    /** Readings that cost less [ns] are made whenever they are wanted. */
    private static final double CHEAP_NS = 500000.0;
    /** How fast a cost that grows is believed, per reading: a single late one is no reason to read less often. */
    private static final double GROWTH = 1.05;
    private static final double GROWTH_NS = 50000.0;

    /** What the reading of a group costs, and when it is next worth it. On a cabinet each getter takes about 2 ms. */
    private static final class Gauge {
        final int bit;
        /** Share of the thread's time that this group may take. */
        final double share;
        double cost;
        long began;
        long stamp;
        long next;

        Gauge(int bit, double share) {
            this.bit = bit;
            this.share = share;
        }
    }

    private static final class Subscription {
        final int groups;
        final long period;
        long due;

        Subscription(int groups, long period, long due) {
            this.groups = groups;
            this.period = period;
            this.due = due;
        }
    }

    // the shares add up to less than one, so that the thread keeps up with a cabinet of any slowness
    private final Gauge jointsGauge = new Gauge(Groups.JOINTS, 0.4);
    private final Gauge torquesGauge = new Gauge(Groups.TORQUES, 0.2);
    private final Gauge poseGauge = new Gauge(Groups.POSE, 0.1);
    private final Gauge wrenchGauge = new Gauge(Groups.WRENCH, 0.1);
    private final Gauge motionGauge = new Gauge(Groups.MOTION, 0.05);
    private final Gauge safetyGauge = new Gauge(Groups.SAFETY, 0.1);
    private final Gauge ioGauge = new Gauge(Groups.IO, 0.04);
    private volatile JointState joints;
    private TorqueState torques;
    private PoseState pose;
    private WrenchState wrench;
    private MotionState motion;
    private SafetyState safety;
    private IoState io;
    private ModeState mode;

    private final Server server;
    private final Map<Client, Subscription> subscriptions = new ConcurrentHashMap<Client, Subscription>();
    private final double[] last = new double[7];
    private final double[] velocity = new double[7];
    private long lastStamp;
    private Thread thread;
    private volatile boolean closed;

    Sampler(Server server) {
        this.server = server;
    }

    void start() {
        thread = new Thread(new Runnable() {
            public void run() {
                work();
            }
        }, "ha-sampler");
        thread.setDaemon(true);
        thread.start();
    }

    void close() {
        closed = true;
        Threads.end(thread);
    }

    void subscribe(Client client, int groups, double rate) {
        if (rate <= 0.0 || groups == 0) {
            subscriptions.remove(client);
            return;
        }
        long period = Math.round(1e9 / rate);
        long now = server.clock.nanos();
        subscriptions.put(client, new Subscription(groups, period, now - now % period + period));
    }

    void forget(Client client) {
        subscriptions.remove(client);
    }

    private void work() {
        boolean failing = false;
        try {
            while (!closed) {
                long now = server.clock.sleepUntil(next());
                try {
                    serve(now);
                    failing = false;
                } catch (RuntimeException e) {
                    if (!failing) { // once, not fifty times a second: a cabinet's log is slow
                        server.log.error("reading the robot's state", e);
                    }
                    failing = true;
                    server.clock.sleepUntil(server.clock.nanos() + IDLE_NS);
                }
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private long next() {
        long next = server.clock.nanos() + IDLE_NS;
        for (Subscription one : subscriptions.values()) {
            next = Math.min(next, one.due);
        }
        return next;
    }

    private void serve(long now) {
        int wanted = 0;
        for (Subscription one : subscriptions.values()) {
            if (one.due <= now) {
                wanted |= one.groups;
            }
        }
        if (wanted == 0) {
            return;
        }
        State all = sample(now, wanted);
        for (Map.Entry<Client, Subscription> entry : subscriptions.entrySet()) {
            Subscription one = entry.getValue();
            if (one.due > now) {
                continue;
            }
            one.due += one.period;
            if (one.due <= now) { // subscribed while this thread slept: the past is not for it
                one.due = now / one.period * one.period + one.period;
            }
            if (server.clock.nanos() - one.due > TOO_LATE * one.period) {
                one.due = server.clock.nanos() / one.period * one.period + one.period;
            }
            State chosen = one.groups == wanted ? all : choose(all, one.groups);
            entry.getKey().state(server.frame(chosen, 0));
        }
    }

    /** Reads the groups that are wanted and worth their cost now; of the others the newest samples stay. */
    private State sample(long now, int groups) {
        Robot robot = server.robot;
        if (begin(jointsGauge, groups, now)) {
            joints = joints(jointsGauge.stamp);
            end(jointsGauge);
        }
        if (begin(torquesGauge, groups, now)) {
            double[] measured = new double[7];
            double[] external = new double[7];
            double[] commanded = new double[7];
            robot.readTorques(measured, external, commanded);
            torques = new TorqueState(torquesGauge.stamp, measured, external, commanded);
            end(torquesGauge);
        }
        if (begin(poseGauge, groups, now)) {
            pose = robot.readPose(poseGauge.stamp);
            end(poseGauge);
        }
        if (begin(wrenchGauge, groups, now)) {
            wrench = robot.readWrench(wrenchGauge.stamp);
            end(wrenchGauge);
        }
        if (begin(motionGauge, groups, now)) {
            double[] progress = {Double.NaN, Double.NaN};
            robot.readProgress(progress);
            long[] status = server.executor.status();
            motion = new MotionState(motionGauge.stamp, status[0], (int) status[1], (int) status[2], progress[0], progress[1],
                    robot.override());
            end(motionGauge);
        }
        if (begin(safetyGauge, groups, now)) {
            safety = robot.readSafety(safetyGauge.stamp);
            end(safetyGauge);
        }
        if (begin(ioGauge, groups, now)) {
            io = server.signals.read(ioGauge.stamp);
            end(ioGauge);
        }
        if ((groups & Groups.MODE) != 0) { // the core knows it by itself
            String[] fitted = server.rack.fitted();
            mode = new ModeState(now, server.executor.mode(), fitted[0], fitted[1], fitted[2]);
        }
        return choose(new State(joints, torques, pose, wrench, motion, safety, io, mode), groups);
    }

    private boolean begin(Gauge gauge, int groups, long now) {
        if ((groups & gauge.bit) == 0 || now < gauge.next) {
            return false;
        }
        gauge.stamp = gauge.next == 0 ? now : server.clock.nanos(); // behind slow readings it is not `now` any more
        gauge.began = System.nanoTime();
        return true;
    }

    private void end(Gauge gauge) {
        double cost = System.nanoTime() - gauge.began;
        gauge.cost = Math.min(cost, gauge.cost * GROWTH + GROWTH_NS);
        gauge.next = gauge.cost < CHEAP_NS ? 0 : gauge.stamp + (long) (gauge.cost * server.clock.rate() / gauge.share);
    }

    /** The joints now, read by another thread; the newest velocity that is known. */
    JointState joints() {
        double[] q = new double[7];
        double[] commanded = new double[7];
        long now = server.clock.nanos();
        server.robot.readJoints(q, commanded);
        JointState newest = joints;
        double[] unknown = new double[7];
        java.util.Arrays.fill(unknown, Double.NaN);
        return new JointState(now, q, commanded, newest == null ? unknown : newest.dq);
    }

    /** The torques now, read by another thread. */
    TorqueState torques() {
        double[] measured = new double[7];
        double[] external = new double[7];
        double[] commanded = new double[7];
        long now = server.clock.nanos();
        server.robot.readTorques(measured, external, commanded);
        return new TorqueState(now, measured, external, commanded);
    }

    /** The velocity is a low-pass filtered difference, since the cabinet tells none. */
    private JointState joints(long now) {
        double[] q = new double[7];
        double[] commanded = new double[7];
        server.robot.readJoints(q, commanded);
        double dt = (now - lastStamp) * 1e-9;
        double[] dq = new double[7];
        if (lastStamp == 0 || dt > 1.0) {
            java.util.Arrays.fill(velocity, 0.0);
            java.util.Arrays.fill(dq, lastStamp == 0 ? Double.NaN : 0.0);
        } else if (dt > 0.0) {
            double gain = 1.0 - Math.exp(-dt / FILTER);
            for (int i = 0; i < 7; i++) {
                velocity[i] += gain * ((q[i] - last[i]) / dt - velocity[i]);
                dq[i] = velocity[i];
            }
        } else {
            System.arraycopy(velocity, 0, dq, 0, 7);
        }
        System.arraycopy(q, 0, last, 0, 7);
        lastStamp = now;
        return new JointState(now, q, commanded, dq);
    }

    private static State choose(State all, int groups) {
        return new State((groups & Groups.JOINTS) != 0 ? all.joints : null, (groups & Groups.TORQUES) != 0 ? all.torques : null,
                (groups & Groups.POSE) != 0 ? all.pose : null, (groups & Groups.WRENCH) != 0 ? all.wrench : null,
                (groups & Groups.MOTION) != 0 ? all.motion : null, (groups & Groups.SAFETY) != 0 ? all.safety : null,
                (groups & Groups.IO) != 0 ? all.io : null, (groups & Groups.MODE) != 0 ? all.mode : null);
    }
}
