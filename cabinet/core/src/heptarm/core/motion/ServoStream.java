package heptarm.core.motion;

import java.util.Arrays;

import heptarm.core.Clock;
import heptarm.core.Clocks;
import heptarm.core.CommandRejected;
import heptarm.core.checks.ModeChecks;
import heptarm.core.checks.ServoChecks;
import heptarm.core.robot.MotionJob;
import heptarm.core.robot.MotionPort;
import heptarm.core.robot.ServoJob;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.Mode;
import heptarm.wire.ServoOpen;
import heptarm.wire.ServoStatus;

/**
 * A servo motion with its stream of targets. The readers of the connections offer targets, the motion thread applies them: the
 * newest replaces a waiting one, and each carries the time within which the next must arrive.
 */
public final class ServoStream implements Activity {
    private static final int AGES = 4096;
    private static final double STATUS_PERIOD = 1.0;
    /** The client of an older target does not know the cabinet's clock [s]. */
    private static final double MAX_AGE = 60.0;
    /** A wait that takes so much too long means that this machine stood still meanwhile. */
    private static final long OVERSLEPT_NS = 5000000L;

    /** One target: either joints or a pose. */
    public static final class Target {
        public final double[] q;
        public final double[] velocity;
        final double[] xyz;
        final double[] quat;
        final double watchdog;
        final long sent;

        public Target(double[] q, double[] velocity, double[] xyz, double[] quat, double watchdog, long sent) {
            this.q = q;
            this.velocity = velocity;
            this.xyz = xyz;
            this.quat = quat;
            this.watchdog = watchdog;
            this.sent = sent;
        }

        private void apply(ServoJob servo) throws CommandRejected {
            if (q != null) {
                servo.follow(q, velocity);
            } else {
                servo.followPose(xyz, quat);
            }
        }
    }

    private final ServoOpen open;
    private final MotionPort port;
    private final ConditionWatcher watcher;
    private final MotionReporter reporter;
    private final Clock clock;
    private final double[] ages = new double[AGES];
    private long id;
    private ServoJob servo;
    private Target pending;
    private Mode mode;
    private double watchdog;
    private boolean isStarted;
    private MotionJob.Outcome outcome;
    private boolean closed;
    private boolean isNumbered;
    private long newest;
    private long targets;
    private long applied;
    private long rejected;
    private long late;
    private int code;
    private String text = "";
    private long reported;

    ServoStream(ServoOpen open, MotionPort port, ConditionWatcher watcher, MotionReporter reporter, Clock clock) {
        this.open = open;
        this.port = port;
        this.watcher = watcher;
        this.reporter = reporter;
        this.clock = clock;
        this.mode = open.mode;
        this.watchdog = open.watchdog;
    }

    public void number(long accepted) {
        id = accepted;
    }

    public synchronized Mode mode() {
        return mode;
    }

    // ------------------------------------------------------------------------------------------- any thread

    /** Whether a target is newer than all so far, which it then is; one without a number (0) always is. */
    public synchronized boolean isNewer(long number) {
        if (number == 0) {
            return true;
        }
        if (isNumbered && (int) (number - newest) <= 0) { // the numbers wrap
            return false;
        }
        isNumbered = true;
        newest = number;
        return true;
    }

    /** Check a target and queue it; it replaces one that has not been applied yet. */
    public void offer(Target target) throws CommandRejected {
        ServoChecks.check(open.engine, target.q != null, target.velocity != null);
        queue(target);
    }

    private synchronized void queue(Target target) {
        targets++;
        pending = target;
        notifyAll();
    }

    /** Count a rejected target. It does not reset the watchdog. */
    public synchronized void reject(CommandRejected why) {
        targets++;
        note(why);
    }

    private void note(CommandRejected why) {
        rejected++;
        code = why.code;
        text = why.getMessage();
    }

    /** Change the parameters of the control mode. */
    public void changeMode(Mode newer) throws CommandRejected {
        ServoJob running;
        synchronized (this) {
            running = isStarted && outcome == null ? servo : null;
        }
        String kind = open.mode == null ? "PositionMode" : open.mode.getClass().getSimpleName();
        if (!newer.getClass().getSimpleName().equals(kind)) {
            throw new CommandRejected(Code.MODE_CONFLICT, "mode", newer.getClass().getSimpleName(), kind,
                    "a servo motion cannot change the kind of its control mode; close it and open another one");
        }
        if (!ModeChecks.frame(newer).equals(ModeChecks.frame(open.mode))) {
            throw new CommandRejected(Code.MODE_CONFLICT, "mode.frame", ModeChecks.frame(newer), ModeChecks.frame(open.mode),
                    "a servo motion cannot change the frame of its control mode; close it and open another one");
        }
        if (running == null) {
            throw new CommandRejected(Code.MODE_CONFLICT, "servo", Long.toString(id), "", "servo motion " + id + " is not running; open one first");
        }
        running.changeMode(newer);
        synchronized (this) {
            mode = newer;
        }
    }

    // ----------------------------------------------------------------------------------- threads of the robot

    public synchronized void started() {
        isStarted = true;
        notifyAll();
    }

    public synchronized void ended(MotionJob.Outcome how) {
        outcome = how;
        notifyAll();
    }

    public synchronized void close() {
        closed = true;
        notifyAll();
    }

    // ----------------------------------------------------------------------------------- the motion thread

    /** Follows the targets; if the robot's servo motion timed out without one, starts it again with the next. */
    public void perform(Program program) throws InterruptedException {
        ConditionWatcher.Watch watch = watcher.watch(program, 0, open.until);
        try {
            follow(program, watch);
        } finally {
            watch.close();
        }
        report();
    }

    private void follow(Program program, ConditionWatcher.Watch watch) throws InterruptedException {
        String starved = "";
        boolean goesOn = true;
        while (goesOn) {
            prepare();
            program.restart(0);
            try {
                ServoJob next = port.openServo(present(), program.listener(0));
                adopt(next);
                program.adopt(next);
                if (awaitStart()) {
                    watch.start();
                    starved = applyTargets();
                }
            } catch (CommandRejected e) {
                program.fail(0, e.code, e.getMessage());
            }
            if (starved.length() > 0) {
                program.end(Cause.STARVED, starved);
            }
            goesOn = program.await(0) == MotionJob.Outcome.DONE && program.cause() == null;
            if (goesOn && !awaitNext()) {
                program.end(Cause.STARVED, "no target arrived for " + watchdog + " s after the servo motion timed out");
                goesOn = false;
            }
        }
    }

    /** What the client opened, in the mode that it has changed to since: a motion that starts again must not be stiffer than that. */
    private ServoOpen present() {
        return new ServoOpen(open.engine, open.frame, mode(), open.velocity, open.acceleration, open.linear, open.timing, open.watchdog,
                open.until);
    }

    private synchronized void adopt(ServoJob next) {
        servo = next;
    }

    /** Clear what is known of a previous motion. */
    private synchronized void prepare() {
        isStarted = false;
        outcome = null;
    }

    /** Wait for the start of the motion; false if it ended before. */
    private synchronized boolean awaitStart() throws InterruptedException {
        while (!isStarted && outcome == null && !closed) {
            wait();
        }
        return isStarted && outcome == null && !closed;
    }

    /** Apply targets until the motion or the program ends (returns ""), or until none arrives in time (returns the reason). */
    private String applyTargets() throws InterruptedException {
        while (true) {
            Target next;
            synchronized (this) {
                next = await();
                if (closed || outcome != null) {
                    return "";
                }
                pending = null;
                if (next == null) {
                    late++;
                    return "no target arrived within " + Math.round(watchdog * 1000) + " ms";
                }
                watchdog = next.watchdog;
            }
            apply(next);
            if (clock.nanos() - reported > STATUS_PERIOD * 1e9) {
                report();
            }
        }
    }

    /** Wait for a target after the robot's servo motion timed out; false if none arrives in time. */
    private synchronized boolean awaitNext() throws InterruptedException {
        outcome = null;
        return await() != null && !closed;
    }

    /** Under the lock: wait for the next target; null when the watchdog expires, or the motion or the program has ended. */
    private Target await() throws InterruptedException {
        long deadline = Clocks.afterClientSeconds(clock, watchdog);
        boolean overslept = false;
        while (pending == null && outcome == null && !closed) {
            if (clock.nanos() - deadline > OVERSLEPT_NS * clock.rate() && !overslept) {
                overslept = true; // this machine stood still; what arrived meanwhile is not read yet
                deadline = Clocks.afterClientSeconds(clock, watchdog);
            }
            if (!Clocks.await(this, clock, deadline)) {
                return null;
            }
        }
        return pending;
    }

    private void apply(Target target) {
        try {
            target.apply(servo);
            double age = (clock.nanos() - target.sent) * 1e-9;
            synchronized (this) {
                ages[(int) (applied++ % AGES)] = Math.abs(age) < MAX_AGE ? age : Double.NaN;
            }
        } catch (CommandRejected e) {
            synchronized (this) {
                if (!closed && outcome == null) { // one that came too late was not rejected
                    note(e);
                }
            }
        }
    }

    /** Publish the statistics of the stream. */
    private void report() {
        reported = clock.nanos();
        ServoStatus status;
        synchronized (this) {
            double[] sorted = Arrays.copyOf(ages, (int) Math.min(applied, AGES));
            Arrays.sort(sorted); // NaN go to the end
            int size = sorted.length;
            while (size > 0 && Double.isNaN(sorted[size - 1])) {
                size--;
            }
            double median = size == 0 ? Double.NaN : sorted[size / 2];
            double p99 = size == 0 ? Double.NaN : sorted[(int) (size * 0.99)];
            status = new ServoStatus(id, targets, applied, rejected, late, median, p99, code, text);
        }
        reporter.publish(status);
    }
}
