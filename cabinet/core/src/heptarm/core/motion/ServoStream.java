package heptarm.core;

import java.util.Arrays;

import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.ServoOpen;
import heptarm.wire.ServoStatus;

/**
 * Targets of a servo motion between the reader that brings them and the motion thread that applies them: the newest wins,
 * and each brings the time within which the next one has to come.
 */
final class Stream implements Activity {
    private static final int AGES = 4096;
    private static final double STATUS_PERIOD = 1.0;
    /** An older target was sent by a client that does not know the cabinet's clock. */
    private static final double CREDIBLE = 60.0;
    /** A wait that lasts so much longer than it should says that this machine stood still meanwhile. */
    private static final long OVERSLEPT_NS = 5000000L;

    /** One target. Either joints or a pose. */
    static final class Target {
        final double[] q;
        final double[] velocity;
        final double[] xyz;
        final double[] quat;
        final double watchdog;
        final long sent;

        Target(double[] q, double[] velocity, double[] xyz, double[] quat, double watchdog, long sent) {
            this.q = q;
            this.velocity = velocity;
            this.xyz = xyz;
            this.quat = quat;
            this.watchdog = watchdog;
            this.sent = sent;
        }

        private void apply(Servo servo) throws Refusal {
            if (q != null) {
                servo.follow(q, velocity);
            } else {
                servo.followPose(xyz, quat);
            }
        }
    }

    final ServoOpen open;
    private final Server server;
    private final double[] ages = new double[AGES];
    private long id;
    private Servo servo;
    private Target pending;
    private heptarm.wire.Mode mode;
    private double watchdog;
    private boolean started;
    private Job.Ended ended;
    private boolean closed;
    private long targets;
    private long applied;
    private long refused;
    private long late;
    private int code;
    private String text = "";
    private long told;

    Stream(Server server, ServoOpen open) {
        this.server = server;
        this.open = open;
        this.mode = open.mode;
        this.watchdog = open.watchdog;
    }

    public void number(long accepted) {
        id = accepted;
    }

    public synchronized heptarm.wire.Mode mode() {
        return mode;
    }

    // -------------------------------------------------------------------------------------- from the readers

    /** Leaves a target; one that has not been applied yet is forgotten. */
    synchronized void offer(Target target) {
        targets++;
        pending = target;
        notifyAll();
    }

    /** Counts a target that may not be applied. It does not count as a sign of life. */
    synchronized void refuse(Refusal why) {
        targets++;
        note(why);
    }

    private void note(Refusal why) {
        refused++;
        code = why.code;
        text = why.getMessage();
    }

    void change(heptarm.wire.Mode newer) throws Refusal {
        Servo running;
        synchronized (this) {
            running = started && ended == null ? servo : null;
        }
        String kind = open.mode == null ? "PositionMode" : open.mode.getClass().getSimpleName();
        if (!newer.getClass().getSimpleName().equals(kind)) {
            throw new Refusal(Code.MODE_CONFLICT, "mode", newer.getClass().getSimpleName(), kind,
                    "a running servo motion keeps the kind of its control mode; close it and open another one");
        }
        if (!ModeRules.frame(newer).equals(ModeRules.frame(open.mode))) {
            throw new Refusal(Code.MODE_CONFLICT, "mode.frame", ModeRules.frame(newer), ModeRules.frame(open.mode),
                    "a running servo motion keeps the frame of its control mode; close it and open another one");
        }
        if (running == null) {
            throw new Refusal(Code.MODE_CONFLICT, "servo", Long.toString(id), "", "servo motion " + id + " is not running");
        }
        running.change(newer);
        synchronized (this) {
            mode = newer;
        }
    }

    // ------------------------------------------------------------------------------------- from the listeners

    public synchronized void begun() {
        started = true;
        notifyAll();
    }

    public synchronized void over(Job.Ended how) {
        ended = how;
        notifyAll();
    }

    /** The program has ended: whoever waits here need not. */
    public synchronized void close() {
        closed = true;
        notifyAll();
    }

    // ---------------------------------------------------------------------------------- by the motion thread

    /** Lets a servo motion follow the targets; one that ended because none came for long is begun anew with the next. */
    public void perform(Program program) throws InterruptedException {
        Guard guard = new Guard(server, program, 0, open.until);
        try {
            carryOut(program, guard);
        } finally {
            guard.close();
        }
        tell();
    }

    private void carryOut(Program program, Guard guard) throws InterruptedException {
        String starved = "";
        boolean goesOn = true;
        while (goesOn) {
            prepare();
            program.renew(0);
            try {
                Servo next = server.robot.servo(open, program.listener(0));
                adopt(next);
                program.adopt(next);
                if (awaitStart()) {
                    guard.start();
                    starved = follow();
                }
            } catch (Refusal e) {
                program.fail(0, e.code, e.getMessage());
            }
            if (starved.length() > 0) {
                program.end(Cause.STARVED, starved);
            }
            goesOn = program.await(0) == Job.Ended.DONE && program.cause() == null;
            if (goesOn && !awaitNext()) {
                program.end(Cause.STARVED, "no target came for so long that the servo motion ended");
                goesOn = false;
            }
        }
    }

    /** A motion is about to start; what is known of one before it does not count any more. */
    private synchronized void adopt(Servo next) {
        servo = next;
    }

    private synchronized void prepare() {
        started = false;
        ended = null;
    }

    /** Waits for the start of the motion; false if it ended before. */
    private synchronized boolean awaitStart() throws InterruptedException {
        while (!started && ended == null && !closed) {
            wait();
        }
        return started && ended == null && !closed;
    }

    /** Applies targets until the motion or the program ends, or until none came in time; then it returns why in words. */
    private String follow() throws InterruptedException {
        while (true) {
            Target next;
            synchronized (this) {
                next = await();
                if (closed || ended != null) {
                    return "";
                }
                pending = null;
                if (next == null) {
                    late++;
                    return "no target came within " + Math.round(watchdog * 1000) + " ms";
                }
                watchdog = next.watchdog;
            }
            apply(next);
            if (server.clock.nanos() - told > STATUS_PERIOD * 1e9) {
                tell();
            }
        }
    }

    /** Waits for a target after a motion that ended by itself; null if none came in time. */
    private synchronized boolean awaitNext() throws InterruptedException {
        ended = null;
        return await() != null && !closed;
    }

    /** Under the lock: the next target; null when the watchdog's time is over, or something has ended. */
    private Target await() throws InterruptedException {
        long period = (long) (watchdog * 1e9); // the client's seconds, not a simulator's
        long deadline = System.nanoTime() + period;
        boolean overslept = false;
        while (pending == null && ended == null && !closed) {
            long left = deadline - System.nanoTime();
            if (left < -OVERSLEPT_NS && !overslept) { // this machine stood still, and what came meanwhile is not read yet
                overslept = true;
                left = period;
                deadline = System.nanoTime() + period;
            }
            if (left <= 0) {
                return null;
            }
            java.util.concurrent.TimeUnit.NANOSECONDS.timedWait(this, left);
        }
        return pending;
    }

    private void apply(Target target) {
        try {
            target.apply(servo);
            double age = (server.clock.nanos() - target.sent) * 1e-9;
            synchronized (this) {
                ages[(int) (applied++ % AGES)] = Math.abs(age) < CREDIBLE ? age : Double.NaN;
            }
        } catch (Refusal e) {
            synchronized (this) {
                if (!closed && ended == null) { // one that came too late was not refused
                    note(e);
                }
            }
        }
    }

    /** Tells everybody what was seen of the stream. */
    private void tell() {
        told = server.clock.nanos();
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
            status = new ServoStatus(id, targets, applied, refused, late, median, p99, code, text);
        }
        server.broadcast(status);
    }
}
