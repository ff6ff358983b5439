package heptarm.core;

import heptarm.wire.Code;
import heptarm.wire.MotionFinished;

/** Motions that were started, and how they ended. */
public final class Handle {
    public final long id;
    private final Arm arm;
    private MotionFinished end;

    Handle(Arm arm, long id) {
        this.arm = arm;
        this.id = id;
    }

    synchronized void end(MotionFinished how) {
        end = how;
        notifyAll();
    }

    public synchronized boolean isFinished() {
        return end != null;
    }

    /** Waits for the end, and says how it was: the cause, the joints, the residual. */
    public synchronized MotionFinished await() throws InterruptedException {
        while (end == null) {
            wait();
        }
        return end;
    }

    /** The same for at most so many seconds; null: it has not ended by then. */
    public synchronized MotionFinished await(double seconds) throws InterruptedException {
        long deadline = System.nanoTime() + (long) (seconds * 1e9);
        while (end == null) {
            long left = deadline - System.nanoTime();
            if (left <= 0) {
                return null;
            }
            java.util.concurrent.TimeUnit.NANOSECONDS.timedWait(this, left);
        }
        return end;
    }

    /** Brakes on the path; one that has ended already is left alone. */
    public void cancel() throws Refusal {
        try {
            if (!isFinished()) {
                arm.cancel(id);
            }
        } catch (Refusal e) {
            if (e.code != Code.UNKNOWN_MOTION) { // it has just ended by itself
                throw e;
            }
        }
    }
}
