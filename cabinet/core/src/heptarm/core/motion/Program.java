package heptarm.core;

import java.util.ArrayList;
import java.util.List;

import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.ConditionFired;
import heptarm.wire.ItemReached;
import heptarm.wire.MotionStarted;
import heptarm.wire.Run;
import heptarm.wire.SegmentReached;

/** A program, either a run of motions or an activity, and what becomes of it. Guarded by itself. */
final class Program {
    final long id;
    final Run run;
    final Activity activity;
    final Job.Ended[] ended;
    int item;
    Cause cause;
    String why = "";
    int code;
    String text = "";
    long began;
    volatile boolean moved;
    int fired = -1;
    private int firedItem;
    private boolean isFiringTold;
    private final Server server;
    private final List<Job> jobs = new ArrayList<Job>();

    Program(Server server, long id, Run run, Activity activity) {
        this.server = server;
        this.id = id;
        this.run = run;
        this.activity = activity;
        this.ended = new Job.Ended[size()];
    }

    int size() {
        return run == null ? 1 : run.items.length;
    }

    /** Ends it for a cause; the first cause counts. */
    void end(Cause newCause, String newWhy) {
        end(newCause, 0, newWhy);
    }

    void end(Cause newCause, int newCode, String newWhy) {
        List<Job> all;
        synchronized (this) {
            if (cause == null) {
                cause = newCause;
                code = newCode;
                why = newWhy;
            }
            all = new ArrayList<Job>(jobs);
            notifyAll();
        }
        if (activity != null) {
            activity.close();
        }
        for (int i = all.size() - 1; i >= 0; i--) {
            try {
                all.get(i).cancel(); // from the last, so that none of them begins while the others are cancelled
            } catch (RuntimeException e) {
                server.log.error("cancelling item " + i + " of motion " + id, e);
            }
        }
    }

    /** It fails; a cause that it ended for before counts. */
    synchronized void fail(int index, int failureCode, String failure) {
        ended[index] = Job.Ended.FAILED;
        if (cause == null) {
            boolean stopped = failureCode == Code.SAFETY_STOP || server.warden.isStopped();
            cause = stopped ? Cause.SAFETY : Cause.FAILED;
            code = stopped ? Code.SAFETY_STOP : failureCode;
            text = failure;
        } else if (cause == Cause.SAFETY) {
            text = failure; // the robot's own words say more
        }
        notifyAll();
    }

    /** Notes a job; one that comes too late is cancelled. */
    void adopt(Job job) {
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

    /** An item begins anew. */
    synchronized void renew(int index) {
        ended[index] = null;
    }

    /** An item that never began has ended. */
    synchronized void skip(int index) {
        ended[index] = Job.Ended.CANCELLED;
    }

    /** A break condition has fired; the first time counts. */
    synchronized void fired(int index, int node) {
        if (fired < 0) {
            fired = node;
            firedItem = index;
            notifyAll();
        }
    }

    /** Waits for the end of an item; tells meanwhile where the robot was when a break condition fired. */
    Job.Ended await(int index) throws InterruptedException {
        while (true) {
            synchronized (this) {
                while (ended[index] == null && (fired < 0 || isFiringTold)) {
                    wait();
                }
                if (fired < 0 || isFiringTold) {
                    return ended[index];
                }
                isFiringTold = true;
            }
            tellFiring();
        }
    }

    private void tellFiring() {
        try {
            server.broadcast(new ConditionFired(id, firedItem, fired, server.sampler.joints(), server.sampler.torques(),
                    server.robot.readPose(server.clock.nanos()), server.robot.readWrench(server.clock.nanos())));
        } catch (RuntimeException e) { // the end will be told in any case
            server.log.error("reading the robot when a condition of motion " + id + " fired", e);
        }
    }

    Job.Listener listener(final int index) {
        return new Job.Listener() {
            public void started() {
                moved = true;
                synchronized (Program.this) {
                    item = index;
                }
                if (activity != null) {
                    activity.begun(); // before anybody hears of it: what a client orders then finds it running
                }
                server.broadcast(new MotionStarted(id, index));
            }

            public void reached(int segment) {
                server.broadcast(new SegmentReached(id, index, segment));
            }

            public void triggered(int trigger) {
                Triggers.act(server, Program.this, index, trigger);
            }

            public void fired(int node) {
                Program.this.fired(index, node);
            }

            public void finished(Job.Ended how, int failureCode, String failure) {
                if (how == Job.Ended.FAILED) {
                    fail(index, failureCode, failure);
                } else {
                    if (how == Job.Ended.DONE && index + 1 < ended.length) {
                        server.broadcast(new ItemReached(id, index));
                    }
                    if (how == Job.Ended.CONDITION) {
                        end(Cause.CONDITION, ""); // what is behind it does not begin
                    }
                    synchronized (Program.this) {
                        ended[index] = how;
                        Program.this.notifyAll();
                    }
                }
                if (activity != null) {
                    activity.over(how);
                }
            }
        };
    }
}
