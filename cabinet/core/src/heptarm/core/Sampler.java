package heptarm.core;

import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;

import heptarm.wire.Groups;
import heptarm.wire.JointState;
import heptarm.wire.MotionState;
import heptarm.wire.PoseState;
import heptarm.wire.SafetyState;
import heptarm.wire.State;
import heptarm.wire.TorqueState;
import heptarm.wire.WrenchState;

/**
 * Samples the robot's state in groups, each with its own stamp, and hands every subscriber its frames when they are due.
 *
 * <p>This is the only thread that reads state, so a slow getter of the robot never stands in the way of a command. It works
 * on the clock's grid: a late wake-up is caught up state by state, unless it is too late by far.
 */
final class Sampler {
    /** Time constant of the velocity's low-pass filter [s]. */
    private static final double FILTER = 0.01;
    private static final long IDLE_NS = 20000000L;
    private static final int TOO_LATE = 50;

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
        try {
            while (!closed) {
                long now = server.clock.sleepUntil(next());
                try {
                    serve(now);
                } catch (RuntimeException e) {
                    server.log.error("reading the robot's state", e);
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
            entry.getKey().state(server.frame(State.TYPE, chosen.body(), 0));
        }
    }

    private State sample(long now, int groups) {
        JointState joints = (groups & Groups.JOINTS) != 0 ? joints(now) : null;
        TorqueState torques = null;
        if ((groups & Groups.TORQUES) != 0) {
            double[] measured = new double[7];
            double[] external = new double[7];
            double[] commanded = new double[7];
            server.robot.readTorques(measured, external, commanded);
            torques = new TorqueState(now, measured, external, commanded);
        }
        PoseState pose = (groups & Groups.POSE) != 0 ? server.robot.readPose(now) : null;
        WrenchState wrench = (groups & Groups.WRENCH) != 0 ? server.robot.readWrench(now) : null;
        MotionState motion = null;
        if ((groups & Groups.MOTION) != 0) {
            double[] progress = {Double.NaN, Double.NaN};
            server.robot.readProgress(progress);
            long[] status = server.executor.status();
            motion = new MotionState(now, status[0], (int) status[1], (int) status[2], progress[0], progress[1],
                    server.robot.override());
        }
        SafetyState safety = (groups & Groups.SAFETY) != 0 ? server.robot.readSafety(now) : null;
        return new State(joints, torques, pose, wrench, motion, safety, null, null);
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
                (groups & Groups.MOTION) != 0 ? all.motion : null, (groups & Groups.SAFETY) != 0 ? all.safety : null, null, null);
    }
}
