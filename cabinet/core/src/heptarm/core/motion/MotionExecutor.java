package heptarm.core.motion;

import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;

import heptarm.core.Clock;
import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.core.robot.MotionJob;
import heptarm.core.robot.MotionPort;
import heptarm.core.robot.Sensors;
import heptarm.core.safety.SafetyMonitor;
import heptarm.core.state.MotionStatus;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.FriOpen;
import heptarm.wire.HandGuide;
import heptarm.wire.HandGuidingMode;
import heptarm.wire.Item;
import heptarm.wire.Mode;
import heptarm.wire.PositionMode;
import heptarm.wire.Run;
import heptarm.wire.ServoOpen;
import heptarm.wire.StopKind;
import heptarm.wire.When;

/**
 * Executes programs one after the other and reports their outcome.
 *
 * <p><b>States of a program.</b> A {@link Program} <i>waits</i> in the queue, <i>runs</i> (there is at most one, {@link
 * #running}), and has <i>ended</i>. Its items go to the robot one after the other; motions that blend, and no others, as one
 * batch ({@link BlendedBatches}), since the robot plans a blend only where it has both motions in advance. A program ends when
 * all its items have ended, or early for a {@link Cause}: cancelled, replaced, stopped, safety, a break condition, failed. The
 * first cause counts. A safety stop often looks like a failed motion at first; so the robot's state decides which of the two it
 * was, and a second report may only make the text more precise. While the arm reacts to a break condition (a retreat, say), a
 * stop may still take the place of that cause: until {@link Program#settle} it is not the final one.
 *
 * <p><b>The end is asked for, then awaited.</b> {@link Program#end} notes the cause and cancels the robot's jobs, from the last
 * to the first so that none starts meanwhile. A stop notes the cause of all programs, stops the robot, and cancels the jobs after
 * that. Neither waits. The motion thread waits until the robot has reported the end of
 * each item, so the next program starts from an arm at rest, and "finished" is reported once and last. A program that never ran
 * is reported by the request that ended it. After a failure the waiting programs are dropped: the robot is not where they should start.
 *
 * <p><b>An activity</b>, a servo motion or an FRI session that commands the robot, is a program without items: it runs for as
 * long as its client keeps it open. It starts only while nothing runs or waits, since it begins at the present position, and nobody can
 * know where that is behind a queue.
 *
 * <p><b>Threads.</b> One thread, {@code ha-motion}, calls the robot's {@code start} and nothing else does: the robot executes
 * motions in the order of these calls, and a call may take as long as the planning of a spline. Requests come from the readers
 * of all connections, the watchdog and the safety monitor; they take the lock for a moment, change queue or cause, and return,
 * so a stop never waits for a motion that is being planned. The robot reports starts, segments and ends from threads of its own
 * ({@link Program#listener}); these only note and wake.
 *
 * <p><b>Locks.</b> This object's lock guards {@link #queue}, {@link #running}, {@link #lastId} and {@link #closed}. Each
 * program's own lock guards its state. They are never held together, and neither while the robot is called or an event is
 * reported: such a call may block, or come back here. So between two steps of a request the state may change; each step
 * therefore tolerates a program that has ended meanwhile ({@link Program#adopt} cancels a job that came too late). {@link
 * #whileIdle} is the one exception: no motion may start while a load is changed, so it holds the lock meanwhile.
 */
public final class MotionExecutor implements SafetyMonitor.Listener, MotionStatus.Source {
    private static final int MAX_QUEUED = 1000;
    private static final int MAX_ITEMS = 20000;

    private final MotionPort port;
    private final ConditionWatcher watcher;
    private final BreakReactions reactions;
    private final MotionReporter reporter;
    private final TriggerActions triggers;
    private final SafetyMonitor safety;
    private final Clock clock;
    private final Log log;
    private final ArrayDeque<Program> queue = new ArrayDeque<Program>();
    private Program running;
    private long lastId;
    private boolean closed;
    private Thread thread;

    public MotionExecutor(MotionPort port, Sensors sensors, ConditionWatcher watcher, MotionReporter reporter, TriggerActions triggers,
            SafetyMonitor safety, Clock clock, Log log) {
        this.port = port;
        this.watcher = watcher;
        this.reactions = new BreakReactions(port, sensors, clock, log);
        this.reporter = reporter;
        this.triggers = triggers;
        this.safety = safety;
        this.clock = clock;
        this.log = log;
    }

    public void start() {
        thread = Threads.start("ha-motion", new Runnable() {
            public void run() {
                work();
            }
        });
    }

    // ------------------------------------------------------------------------------- requests, from any thread

    /** Queue a program; returns its id. */
    public long add(Run run) throws CommandRejected {
        List<Program> replaced = new ArrayList<Program>();
        Program program;
        synchronized (this) {
            if (closed) {
                throw new CommandRejected(Code.SHUTTING_DOWN, "the cabinet application is closing");
            }
            boolean busy = running != null || !queue.isEmpty();
            if (run.when == When.REJECT && busy) {
                throw new CommandRejected(Code.BUSY, "when", "reject", "", "motion " + (running != null ? running.id : queue.peek().id)
                        + " is running; a program need not wait with when=\"queue\" or when=\"replace\"");
            }
            if (queue.size() >= MAX_QUEUED) {
                throw new CommandRejected(Code.QUEUE_FULL, "at most " + MAX_QUEUED + " programs may wait; wait until one has started");
            }
            int items = run.items.length;
            for (Program waiting : queue) {
                items += waiting.size();
            }
            if (items > MAX_ITEMS && run.when != When.REPLACE) {
                throw new CommandRejected(Code.QUEUE_FULL, "items", Integer.toString(run.items.length), "",
                        "at most " + MAX_ITEMS + " motions may wait, got " + items + " with these; send them in several programs");
            }
            if (run.when == When.REPLACE) {
                replaced.addAll(queue);
                queue.clear();
                if (running != null) {
                    replaced.add(0, running);
                }
            }
            program = queue(run, null);
        }
        end(replaced, Cause.REPLACED, "motion " + program.id + " replaced it");
        return program.id;
    }

    /** The next id of a motion or an FRI session. */
    public synchronized long number() {
        lastId = lastId % 0xFFFFFFFFL + 1;
        return lastId;
    }

    private Program queue(Run run, Activity activity) {
        Program program = new Program(number(), run, activity, reporter, triggers, safety, clock, log);
        queue.add(program);
        notifyAll();
        return program;
    }

    /** Start a servo motion; returns its id. */
    public long open(ServoOpen open) throws CommandRejected {
        return open(new ServoStream(open, port, watcher, reporter, clock));
    }

    /** Start an FRI session that commands the robot; returns its id. */
    public long open(FriOpen open) throws CommandRejected {
        return open(new FriActivity(open, port, reporter, clock, log));
    }

    /** No other motion may be running or waiting, since an activity starts at the current position. */
    private synchronized long open(Activity activity) throws CommandRejected {
        if (closed) {
            throw new CommandRejected(Code.SHUTTING_DOWN, "the cabinet application is closing");
        }
        if (running != null || !queue.isEmpty()) {
            throw new CommandRejected(Code.BUSY, "motion " + (running != null ? running.id : queue.peek().id)
                    + " is running; a servo motion or an FRI session begins with the arm at rest");
        }
        Program program = queue(null, activity);
        activity.number(program.id);
        return program.id;
    }

    /** A change that must not happen while the arm moves. */
    public interface Change {
        void make() throws CommandRejected;
    }

    /** Makes a change while no motion is running or waiting; none starts meanwhile. */
    public synchronized void whileIdle(Change change) throws CommandRejected {
        if (running != null || !queue.isEmpty()) {
            throw new CommandRejected(Code.BUSY, "motion " + (running != null ? running.id : queue.peek().id)
                    + " is running; the load changes while the arm is at rest");
        }
        change.make();
    }

    private Mode mode() {
        Mode mode = null;
        if (running != null && running.activity != null) {
            mode = running.activity.mode();
        } else if (running != null) {
            Item item = running.run.items[running.item];
            mode = item.motion instanceof HandGuide ? new HandGuidingMode() : item.mode;
        }
        return orPosition(mode);
    }

    /** The servo motion with an id that is running or about to; null if there is none. */
    public ServoStream servo(long id) {
        Activity activity = activity(id);
        return activity instanceof ServoStream ? (ServoStream) activity : null;
    }

    /** Whether an id is that of an FRI session that commands the robot. */
    public boolean isFri(long id) {
        return activity(id) instanceof FriActivity;
    }

    private synchronized Activity activity(long id) {
        Program program = running != null ? running : queue.peek();
        return program != null && program.id == id ? program.activity : null;
    }

    /** Cancel a motion; id 0: all. */
    public void cancel(long id) throws CommandRejected {
        List<Program> chosen = take(id);
        if (id != 0 && chosen.isEmpty()) {
            throw new CommandRejected(Code.UNKNOWN_MOTION, "id", Long.toString(id), "", "motion " + id + " is neither running nor waiting; it has ended, or its id is wrong");
        }
        end(chosen, Cause.CANCELLED, "");
    }

    /**
     * Stop the arm.
     *
     * @param author who stops it, such as "by panel at 10.0.0.5"
     * @return whether a motion was ended by that
     */
    public boolean stop(StopKind kind, String author) {
        String why = "stopped " + author;
        if (kind == StopKind.AFTER_MOTION) {
            List<Program> waiting;
            synchronized (this) {
                waiting = new ArrayList<Program>(queue);
                queue.clear();
            }
            end(waiting, Cause.STOPPED, why);
            return !waiting.isEmpty();
        }
        List<Program> ended = take(0);
        halt(ended, Cause.STOPPED, why, kind == StopKind.FAST);
        return !ended.isEmpty();
    }

    /** End all motions by a stop of the arm. */
    public void stopAll(Cause cause, String why) {
        halt(take(0), cause, why, false);
    }

    /** The stop comes before anything is cancelled: each cancellation is a call to the robot, and there may be a thousand. */
    private void halt(List<Program> programs, Cause cause, String why, boolean isFast) {
        for (Program program : programs) {
            program.halt(cause, why);
        }
        try {
            if (isFast) {
                port.stopFast();
            } else {
                port.stop();
            }
        } finally {
            for (Program program : programs) {
                program.cancel(true);
                reportUnmoved(program);
            }
        }
    }

    public void endAll(Cause cause, String why) {
        endAll(cause, 0, why);
    }

    private void endAll(Cause cause, int code, String why) {
        end(take(0), cause, code, why);
    }

    /** Ends a program that was accepted but has not moved; the following ones are dropped. */
    public void blocked(String steps) {
        Program program;
        synchronized (this) {
            program = running != null ? running : queue.peek();
        }
        if (program != null && !program.moved) {
            program.end(Cause.FAILED, Code.NEEDS_OPERATOR, steps);
        }
    }

    public void stopped(String reason) {
        endAll(Cause.SAFETY, Code.SAFETY_STOP, reason);
    }

    /** Ends a motion that follows external targets. */
    public void notEnabled(String reason) {
        Program program;
        synchronized (this) {
            program = running;
        }
        if (program != null && program.activity != null) {
            program.end(Cause.SAFETY, Code.SAFETY_STOP, reason);
        }
    }

    private synchronized List<Program> take(long id) {
        List<Program> chosen = new ArrayList<Program>();
        if (running != null && (id == 0 || running.id == id)) {
            chosen.add(running);
        }
        for (Program program : new ArrayList<Program>(queue)) {
            if (id == 0 || program.id == id) {
                queue.remove(program);
                chosen.add(program);
            }
        }
        return chosen;
    }

    private void end(List<Program> programs, Cause cause, String why) {
        end(programs, cause, 0, why);
    }

    private void end(List<Program> programs, Cause cause, int code, String why) {
        for (Program program : programs) {
            program.end(cause, code, why);
            reportUnmoved(program);
        }
    }

    /** Report the end of a program that has not begun; the motion thread reports the others. */
    private void reportUnmoved(Program program) {
        boolean waiting;
        synchronized (this) {
            waiting = program != running;
        }
        if (waiting && program.began == 0) {
            reporter.finished(program, false);
        }
    }

    public synchronized MotionStatus status() {
        return new MotionStatus(running == null ? 0 : running.id, running == null ? 0 : running.item, queue.size(), mode());
    }

    public void close() {
        synchronized (this) {
            closed = true;
            notifyAll();
        }
        try {
            stopAll(Cause.STOPPED, "the cabinet application is closing");
        } catch (RuntimeException e) { // the thread ends all the same
            log.error("stopping the robot", e);
        }
        Threads.join(thread);
    }

    // ------------------------------------------------------------------------------- the motion thread

    private void work() {
        try {
            while (true) {
                Program program;
                synchronized (this) {
                    while (queue.isEmpty() && !closed) {
                        wait();
                    }
                    if (closed) {
                        return;
                    }
                    program = queue.poll();
                    program.began = clock.nanos();
                    running = program;
                }
                try {
                    execute(program);
                } catch (InterruptedException e) {
                    throw e;
                } catch (Throwable e) { // also a class that this cabinet lacks: the next program needs this thread
                    log.error("motion " + program.id, e);
                    synchronized (program) {
                        program.cause = Cause.FAILED;
                        program.code = Code.INTERNAL;
                        program.text = String.valueOf(e);
                    }
                    program.end(Cause.FAILED, "");
                }
                List<Program> following = new ArrayList<Program>();
                synchronized (this) {
                    running = null;
                    if (program.cause == Cause.FAILED) { // the robot is not where the next program starts
                        following.addAll(queue);
                        queue.clear();
                    }
                }
                reporter.finished(program, true);
                end(following, Cause.DROPPED, "motion " + program.id + " before it failed");
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private void execute(Program program) throws InterruptedException {
        if (program.activity != null) {
            program.activity.perform(program);
            return;
        }
        for (int i = 0; i < program.run.items.length; i++) {
            if (program.cause() != null) {
                program.skip(i);
                continue;
            }
            int together = BlendedBatches.length(program.run.items, i);
            Item last = program.run.items[i + together - 1];
            program.contact = last.until.nodes.length > 0 ? reactions.record(i, last) : null;
            if (together > 1) {
                start(program, i, together);
                i += together - 1;
                if (program.run.items[i].until.nodes.length > 0) {
                    watch(program, i);
                }
                continue;
            }
            try {
                Item item = program.run.items[i];
                program.adopt(port.start(item, orPosition(item.mode), program.listener(i)));
            } catch (CommandRejected e) {
                program.listener(i).finished(MotionJob.Outcome.FAILED, e.code, e.getMessage());
            }
            if (program.run.items[i].until.nodes.length > 0) { // nothing starts after a motion that a condition may end
                watch(program, i);
            }
        }
        boolean isCancelled = false;
        for (int i = 0; i < program.outcomes.length; i++) {
            program.await(i);
            if (program.cause() != null && !isCancelled) { // once: each item would cancel all the others
                isCancelled = program.cancel(false);
            }
        }
    }

    /** Hands a batch to the robot. */
    private void start(Program program, int first, int count) {
        Item[] items = Arrays.copyOfRange(program.run.items, first, first + count);
        MotionJob.Listener[] listeners = new MotionJob.Listener[count];
        for (int i = 0; i < count; i++) {
            listeners[i] = program.listener(first + i);
        }
        try {
            program.adopt(port.start(items, orPosition(items[0].mode), listeners));
        } catch (CommandRejected e) {
            for (int i = 1; i < count; i++) {
                program.skip(first + i);
            }
            listeners[0].finished(MotionJob.Outcome.FAILED, e.code, e.getMessage());
        }
    }

    private static Mode orPosition(Mode mode) {
        return mode == null ? new PositionMode() : mode;
    }

    /** Waits for the end of a motion with a break condition, and for the reaction to it. */
    private void watch(Program program, int item) throws InterruptedException {
        awaitEnd(program, item);
        reactions.react(program, program.run.items[item]);
    }

    /** Waits for the end of a motion with a break condition; monitors the condition if the robot does not. */
    private void awaitEnd(Program program, int item) throws InterruptedException {
        Condition until = program.run.items[item].until;
        // the robot's API documents no break conditions for hand guiding
        if (!(program.run.items[item].motion instanceof HandGuide) && port.monitors(until)) {
            program.await(item);
            return;
        }
        ConditionWatcher.Watch watch = watcher.watch(program, item, until);
        watch.start();
        try {
            program.await(item);
        } finally {
            watch.close();
        }
    }
}
