package heptarm.core.state;

import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;

import heptarm.core.Clock;
import heptarm.core.FailureLog;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.core.robot.Robot;
import heptarm.core.tools.ToolTable;
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
 * Samples the robot's state in groups, each with its own stamp, and sends every subscriber its frames when they are due.
 *
 * <p>A slow getter of the robot never delays a command: only this thread reads state, and no other thread waits for it. It
 * works on the clock's grid: after a late wake-up it catches up state by state, unless it is very late. A group that is slow
 * to read is read less often than it is sent; it is then sent again with its old stamp.
 */
public final class StateSampler {
    /** Time between two looks for new subscribers [ns], and the least by the machine's clock. */
    private static final long IDLE_NS = 20000000L;
    private static final long LEAST_IDLE_NS = 500000L;
    /** Later than this [ns], and than so many states, the past states are given up: the ring of a virtual robot has 0.5 s. */
    private static final long TOO_LATE_NS = 400000000L;
    private static final int TOO_LATE = 50;

    /** Groups cheaper than this [ns] are read whenever they are due. */
    private static final double CHEAP_NS = 500000.0;
    /** How fast the estimated cost may grow per reading: a single late reading is no reason to read less often. */
    private static final double GROWTH = 1.05;
    private static final double GROWTH_NS = 50000.0;

    /** Receives the states of a subscription. */
    public interface Subscriber {
        /** Takes a state; does not block. */
        void receive(State state);

        /** Takes a state in the sampler's thread as far as that goes; called while there is no other subscriber to delay. */
        void receiveAlone(State state);

        /** Takes the number of states that were due before the next one and were not sampled. */
        void miss(long count);
    }

    /** What reading a group costs, and when to read it next. On a cabinet each getter takes about 2 ms. */
    private static final class ReadBudget {
        final int bit;
        /** Fraction of the thread's time that this group may take. */
        final double fraction;
        double cost;
        long began;
        long stamp;
        long next;

        ReadBudget(int bit, double fraction) {
            this.bit = bit;
            this.fraction = fraction;
        }
    }

    private static final class Subscription {
        final int groups;
        final long period;
        long due;
        /** States that were not sampled since the last one that was; before the first one none count. */
        long missed;
        boolean hasBegun;

        Subscription(int groups, long period, long due) {
            this.groups = groups;
            this.period = period;
            this.due = due;
        }
    }

    // the fractions add up to less than one, so that the thread keeps up with any cabinet, however slow
    private final ReadBudget jointsBudget = new ReadBudget(Groups.JOINTS, 0.4);
    private final ReadBudget torquesBudget = new ReadBudget(Groups.TORQUES, 0.2);
    private final ReadBudget poseBudget = new ReadBudget(Groups.POSE, 0.1);
    private final ReadBudget wrenchBudget = new ReadBudget(Groups.WRENCH, 0.1);
    private final ReadBudget motionBudget = new ReadBudget(Groups.MOTION, 0.05);
    private final ReadBudget safetyBudget = new ReadBudget(Groups.SAFETY, 0.1);
    private final ReadBudget ioBudget = new ReadBudget(Groups.IO, 0.04);
    private JointState joints;
    private TorqueState torques;
    private PoseState pose;
    private WrenchState wrench;
    private MotionState motion;
    private SafetyState safety;
    private IoState io;
    private ModeState mode;

    private final Robot robot;
    private final StateReader reader;
    private final MotionStatus.Source motions;
    private final SignalTable signals;
    private final ToolTable tools;
    private final Clock clock;
    private final Log log;
    private final Map<Subscriber, Subscription> subscriptions = new ConcurrentHashMap<Subscriber, Subscription>();
    private Thread thread;
    private volatile boolean closed;

    public StateSampler(Robot robot, StateReader reader, MotionStatus.Source motions, SignalTable signals, ToolTable tools,
            Clock clock, Log log) {
        this.robot = robot;
        this.reader = reader;
        this.motions = motions;
        this.signals = signals;
        this.tools = tools;
        this.clock = clock;
        this.log = log;
    }

    public void start() {
        thread = Threads.start("ha-sampler", new Runnable() {
            public void run() {
                work();
            }
        });
    }

    public void close() {
        closed = true;
        Threads.end(thread);
    }

    /** Send the groups to a subscriber at a rate [Hz]; 0 Hz or no groups: end its subscription. */
    public void subscribe(Subscriber subscriber, int groups, double rate) {
        if (rate <= 0.0 || groups == 0) {
            unsubscribe(subscriber);
            return;
        }
        if ((groups & Groups.IO) != 0) {
            signals.readAllNext();
        }
        long period = Math.round(1e9 / rate);
        long now = clock.nanos();
        synchronized (subscriptions) {
            subscriptions.put(subscriber, new Subscription(groups, period, now - now % period + period));
            subscriptions.notifyAll();
        }
    }

    public void unsubscribe(Subscriber subscriber) {
        subscriptions.remove(subscriber);
    }

    private void work() {
        FailureLog failures = new FailureLog(log);
        try {
            while (!closed) {
                awaitSubscriber();
                long now = clock.sleepUntilReadable(next());
                try {
                    serve(now);
                    failures.succeeded();
                } catch (InterruptedException e) {
                    throw e;
                } catch (Throwable e) { // also a method that this cabinet lacks
                    failures.failed("reading the robot's state", e);
                    clock.sleepUntil(clock.nanos() + IDLE_NS);
                }
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private void awaitSubscriber() throws InterruptedException {
        synchronized (subscriptions) {
            while (subscriptions.isEmpty() && !closed) {
                subscriptions.wait();
            }
        }
    }

    private long next() {
        long next = clock.nanos() + Math.max(IDLE_NS, (long) (LEAST_IDLE_NS * clock.rate()));
        for (Subscription one : subscriptions.values()) {
            next = Math.min(next, one.due);
        }
        return next;
    }

    private void serve(long now) throws InterruptedException {
        int due = 0;
        for (Subscription one : subscriptions.values()) {
            if (one.due <= now) {
                due |= one.groups;
            }
        }
        if (due == 0) {
            return;
        }
        State all = sample(now, due);
        for (Map.Entry<Subscriber, Subscription> entry : subscriptions.entrySet()) {
            Subscription one = entry.getValue();
            if (one.due > now) {
                continue;
            }
            if (one.missed > 0) {
                entry.getKey().miss(one.missed);
            }
            long planned = one.due + one.period;
            one.due = planned;
            if (one.due <= now) { // this thread woke too late for past states
                one.due = now / one.period * one.period + one.period;
            }
            if (clock.nanos() - one.due > Math.max(TOO_LATE_NS, TOO_LATE * one.period)) {
                one.due = clock.nanos() / one.period * one.period + one.period;
            }
            one.missed = one.hasBegun ? (one.due - planned) / one.period : 0;
            one.hasBegun = true;
            State state = one.groups == due ? all : choose(all, one.groups);
            if (subscriptions.size() == 1) {
                entry.getKey().receiveAlone(state);
            } else {
                entry.getKey().receive(state);
            }
        }
    }

    /** Reads the groups that are due and worth their cost now; keeps the newest samples of the others. */
    private State sample(long now, int groups) throws InterruptedException {
        clock.hold(now);
        try {
            readMeasurements(now, groups);
            clock.awaitDue(now); // what follows may change until then
            readStatus(now, groups);
        } finally {
            clock.release();
        }
        return choose(new State(joints, torques, pose, wrench, motion, safety, io, mode), groups);
    }

    private void readMeasurements(long now, int groups) {
        if (begin(jointsBudget, groups, now)) {
            joints = reader.sampleJoints(jointsBudget.stamp);
            end(jointsBudget);
        }
        if (begin(torquesBudget, groups, now)) {
            torques = robot.sensors.readTorques(torquesBudget.stamp);
            end(torquesBudget);
        }
        if (begin(poseBudget, groups, now)) {
            pose = robot.sensors.readPose(poseBudget.stamp);
            end(poseBudget);
        }
        if (begin(wrenchBudget, groups, now)) {
            wrench = robot.sensors.readWrench(wrenchBudget.stamp);
            end(wrenchBudget);
        }
    }

    private void readStatus(long now, int groups) {
        if (begin(motionBudget, groups, now)) {
            double[] progress = {Double.NaN, Double.NaN};
            robot.sensors.readProgress(progress);
            MotionStatus status = motions.status();
            motion = new MotionState(motionBudget.stamp, status.id, status.item, status.waiting, progress[0], progress[1],
                    robot.motion.override());
            end(motionBudget);
        }
        if (begin(safetyBudget, groups, now)) {
            safety = robot.safety.read(safetyBudget.stamp);
            end(safetyBudget);
        }
        if (begin(ioBudget, groups, now)) {
            io = signals.read(ioBudget.stamp);
            end(ioBudget);
        }
        if ((groups & Groups.MODE) != 0) { // needs no reading of the robot
            String[] attached = tools.attached();
            mode = new ModeState(now, motions.status().mode, attached[0], attached[1], attached[2], attached[3]);
        }
    }

    private boolean begin(ReadBudget budget, int groups, long now) {
        if ((groups & budget.bit) == 0 || now < budget.next) {
            return false;
        }
        // the image of the signals has no past; on a robot the time is no longer `now` after slow readings
        budget.stamp = budget == ioBudget ? clock.nanos() : clock.stamp();
        budget.began = System.nanoTime();
        return true;
    }

    private void end(ReadBudget budget) {
        double cost = System.nanoTime() - budget.began;
        budget.cost = Math.min(cost, budget.cost * GROWTH + GROWTH_NS);
        budget.next = budget.cost < CHEAP_NS ? 0 : budget.stamp + (long) (budget.cost * clock.rate() / budget.fraction);
    }

    private static State choose(State all, int groups) {
        return new State((groups & Groups.JOINTS) != 0 ? all.joints : null, (groups & Groups.TORQUES) != 0 ? all.torques : null,
                (groups & Groups.POSE) != 0 ? all.pose : null, (groups & Groups.WRENCH) != 0 ? all.wrench : null,
                (groups & Groups.MOTION) != 0 ? all.motion : null, (groups & Groups.SAFETY) != 0 ? all.safety : null,
                (groups & Groups.IO) != 0 ? all.io : null, (groups & Groups.MODE) != 0 ? all.mode : null);
    }
}
