package heptarm.core.motion;

import java.util.ArrayList;
import java.util.List;

import heptarm.core.Clock;
import heptarm.core.Clocks;
import heptarm.core.Log;
import heptarm.core.robot.MotionJob;
import heptarm.core.safety.SafetyMonitor;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.ItemReached;
import heptarm.wire.MotionStarted;
import heptarm.wire.Run;
import heptarm.wire.SegmentReached;

/** A program, either a run of motions or an activity, and its state. Guarded by its own lock. */
final class Program {
    final long id;
    final Run run;
    final Activity activity;
    final MotionJob.Outcome[] outcomes;
    int item;
    Cause cause;
    String why = "";
    int code;
    String text = "";
    long began;
    volatile boolean moved;
    int fired = -1;
    /** Record of the running item; null if no condition may end it. */
    volatile ContactLog contact;
    private int firedItem;
    private boolean isFiringReported;
    /** Whether a break condition is the final cause of the end; while the arm reacts to it, something else may end the program. */
    private boolean isSettled = true;
    /** Whether the whole robot was stopped; a job that this ended counts as cancelled. */
    private boolean isHalted;
    private MotionJob.Outcome reacted;
    private final MotionReporter reporter;
    private final TriggerActions triggers;
    private final SafetyMonitor safety;
    private final Clock clock;
    private final Log log;
    private final List<MotionJob> jobs = new ArrayList<MotionJob>();

    Program(long id, Run run, Activity activity, MotionReporter reporter, TriggerActions triggers, SafetyMonitor safety, Clock clock,
            Log log) {
        this.id = id;
        this.run = run;
        this.activity = activity;
        this.reporter = reporter;
        this.triggers = triggers;
        this.safety = safety;
        this.clock = clock;
        this.log = log;
        for (int i = 0; run != null && i < run.items.length; i++) {
            isSettled = isSettled && run.items[i].reaction == null;
        }
        this.outcomes = new MotionJob.Outcome[size()];
    }

    int size() {
        return run == null ? 1 : run.items.length;
    }

    /** End the program for a cause; the first cause counts. */
    void end(Cause newCause, String newWhy) {
        end(newCause, 0, newWhy);
    }

    void end(Cause newCause, int newCode, String newWhy) {
        mark(newCause, newCode, newWhy);
        cancel(false);
    }

    /** Note that a stop of the whole robot ends the program; {@link #cancel} must follow. */
    void halt(Cause newCause, String newWhy) {
        synchronized (this) {
            isHalted = true;
        }
        mark(newCause, 0, newWhy);
    }

    private void mark(Cause newCause, int newCode, String newWhy) {
        synchronized (this) {
            if (cause == null || isReacting()) {
                cause = newCause;
                code = newCode;
                why = newWhy;
            }
            notifyAll();
        }
        if (activity != null) {
            activity.close();
        }
    }

    /**
     * Cancel what was handed to the robot.
     *
     * @param isFromFirst the running one first, after a stop; otherwise from the last, so that none starts while the others are cancelled
     * @return whether the robot has taken all of it
     */
    boolean cancel(boolean isFromFirst) {
        List<MotionJob> all;
        synchronized (this) {
            all = new ArrayList<MotionJob>(jobs);
        }
        boolean isTaken = true;
        for (int i = 0; i < all.size(); i++) {
            int index = isFromFirst ? i : all.size() - 1 - i;
            try {
                all.get(index).cancel();
            } catch (Throwable e) { // the others must be cancelled all the same
                isTaken = false;
                log.error("cancelling item " + index + " of motion " + id, e);
            }
        }
        return isTaken;
    }

    private boolean isReacting() {
        return cause == Cause.CONDITION && !isSettled;
    }

    /** An item has failed; an earlier cause of the program's end counts. */
    synchronized void fail(int index, int failureCode, String failure) {
        outcomes[index] = MotionJob.Outcome.FAILED;
        if (cause == null) {
            boolean stopped = failureCode == Code.SAFETY_STOP || safety.isStopped();
            cause = stopped ? Cause.SAFETY : Cause.FAILED;
            code = stopped ? Code.SAFETY_STOP : failureCode;
            text = failure;
        } else if (cause == Cause.SAFETY) {
            text = failure; // the robot's own text is more precise
        }
        notifyAll();
    }

    /** Add a job; cancels it if the program has ended already. */
    void adopt(MotionJob job) {
        boolean late;
        synchronized (this) {
            jobs.add(job);
            late = cause != null;
        }
        if (late) {
            job.cancel();
        }
    }

    synchronized Cause cause() {
        return cause;
    }

    /** An item restarts. */
    synchronized void restart(int index) {
        outcomes[index] = null;
    }

    /** An item ends without having started. */
    synchronized void skip(int index) {
        outcomes[index] = MotionJob.Outcome.CANCELLED;
    }

    /** A break condition has fired; the first one counts. */
    synchronized void fired(int index, int node) {
        if (fired < 0) {
            fired = node;
            firedItem = index;
            notifyAll();
        }
    }

    /** Wait for the end of an item; meanwhile keep its record, and report the robot's state when a break condition fires. */
    MotionJob.Outcome await(int index) throws InterruptedException {
        while (true) {
            boolean isNews;
            synchronized (this) {
                while (outcomes[index] == null && (fired < 0 || isFiringReported) && !isRecordDue()) {
                    rest();
                }
                isNews = fired >= 0 && !isFiringReported;
                if (outcomes[index] != null && !isNews) {
                    return outcomes[index];
                }
                isFiringReported = isFiringReported || isNews;
            }
            if (isNews) {
                reporter.conditionFired(id, firedItem, fired);
            }
            record(isNews);
        }
    }

    /** Wait for the end of the reaction; meanwhile keep the record. */
    void awaitReaction() throws InterruptedException {
        while (true) {
            synchronized (this) {
                while (reacted == null && !isRecordDue()) {
                    rest();
                }
                if (reacted != null) {
                    return;
                }
            }
            record(false);
        }
    }

    private boolean isRecordDue() {
        return contact != null && contact.isActive() && clock.nanos() >= contact.due();
    }

    /** Under the lock: wait for news, or until a record is due. */
    private void rest() throws InterruptedException {
        if (contact != null && contact.isActive()) {
            Clocks.await(this, clock, contact.due());
        } else {
            wait();
        }
    }

    private void record(boolean isTouch) {
        if (contact != null && isTouch) {
            contact.touched();
        } else if (contact != null) {
            contact.record();
        }
    }

    /** Add the job of the reaction; cancels it if something else than the condition has ended the program. */
    void adoptReaction(MotionJob job) {
        boolean late;
        synchronized (this) {
            jobs.add(job);
            late = cause != Cause.CONDITION;
        }
        if (late) {
            job.cancel();
        }
    }

    /** The reaction has failed; the program has, too, but what fired is still reported. */
    synchronized void failReaction(int failureCode, String failure) {
        if (isReacting()) {
            boolean stopped = failureCode == Code.SAFETY_STOP || safety.isStopped();
            cause = stopped ? Cause.SAFETY : Cause.FAILED;
            code = stopped ? Code.SAFETY_STOP : failureCode;
            text = "the reaction to its break condition failed: " + failure;
        }
        reacted = MotionJob.Outcome.FAILED;
        notifyAll();
    }

    /** Whether a break condition has ended it, but the reaction failed. */
    synchronized boolean isReactionFailed() {
        return reacted == MotionJob.Outcome.FAILED;
    }

    /** No reaction is running or follows. */
    synchronized void settle() {
        isSettled = true;
    }

    /** A job that was not cancelled itself does not know that the robot was stopped. */
    private synchronized MotionJob.Outcome orCancelled(MotionJob.Outcome how) {
        return isHalted && how == MotionJob.Outcome.DONE ? MotionJob.Outcome.CANCELLED : how;
    }

    MotionJob.Listener reactionListener() {
        return new MotionJob.Listener() {
            public void started() {
            }

            public void reached(int segment) {
            }

            public void triggered(int trigger) {
            }

            public void fired(int node) {
            }

            public void finished(MotionJob.Outcome outcome, int failureCode, String failure) {
                if (outcome == MotionJob.Outcome.FAILED) {
                    failReaction(failureCode, failure);
                    return;
                }
                synchronized (Program.this) {
                    reacted = outcome;
                    Program.this.notifyAll();
                }
            }
        };
    }

    MotionJob.Listener listener(final int index) {
        return new MotionJob.Listener() {
            public void started() {
                moved = true;
                ContactLog record = contact;
                if (record != null) {
                    record.started(index);
                }
                boolean isOver; // it was handed over while the program ended, and is cancelled at once
                synchronized (Program.this) {
                    isOver = cause != null;
                    item = isOver ? item : index;
                }
                if (activity != null) {
                    activity.started(); // before the event: a client that reacts to it finds the activity running
                }
                if (!isOver) {
                    reporter.publish(new MotionStarted(id, index));
                }
            }

            public void reached(int segment) {
                reporter.publish(new SegmentReached(id, index, segment));
            }

            public void triggered(int trigger) {
                triggers.execute(Program.this, index, trigger);
            }

            public void fired(int node) {
                Program.this.fired(index, node);
            }

            public void finished(MotionJob.Outcome how, int failureCode, String failure) {
                MotionJob.Outcome outcome = orCancelled(how);
                if (outcome == MotionJob.Outcome.FAILED) {
                    fail(index, failureCode, failure);
                } else {
                    if (outcome == MotionJob.Outcome.DONE && index + 1 < outcomes.length) {
                        reporter.publish(new ItemReached(id, index));
                    }
                    if (outcome == MotionJob.Outcome.CONDITION) {
                        end(Cause.CONDITION, ""); // the following items must not start
                    }
                    synchronized (Program.this) {
                        outcomes[index] = outcome;
                        Program.this.notifyAll();
                    }
                }
                if (activity != null) {
                    activity.ended(outcome);
                }
            }
        };
    }
}
