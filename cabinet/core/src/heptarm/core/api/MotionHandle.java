package heptarm.core.api;

import heptarm.core.Clock;
import heptarm.core.Clocks;
import heptarm.core.CommandRejected;
import heptarm.wire.Code;
import heptarm.wire.MotionFinished;

/** A running program of motions, and its result. */
public final class MotionHandle {
    public final long id;
    private final Arm arm;
    private MotionFinished result;

    MotionHandle(Arm arm, long id) {
        this.arm = arm;
        this.id = id;
    }

    synchronized void end(MotionFinished finished) {
        result = finished;
        notifyAll();
    }

    public synchronized boolean isFinished() {
        return result != null;
    }

    /** Wait for the end; returns its cause, the joints and the residual. */
    public synchronized MotionFinished await() throws InterruptedException {
        while (result == null) {
            wait();
        }
        return result;
    }

    /** Wait at most this long, in the cabinet's time [s]; null: it has not ended by then. */
    public synchronized MotionFinished await(double seconds) throws InterruptedException {
        Clock clock = arm.clock();
        long deadline = clock.nanos() + (long) (seconds * 1e9);
        while (result == null) {
            if (!Clocks.await(this, clock, deadline)) {
                return null;
            }
        }
        return result;
    }

    /** Brake on the path; no effect after the end. */
    public void cancel() throws CommandRejected {
        try {
            if (!isFinished()) {
                arm.cancel(id);
            }
        } catch (CommandRejected e) {
            if (e.code != Code.UNKNOWN_MOTION) { // it has just ended
                throw e;
            }
        }
    }
}
