package heptarm.core.state;

import heptarm.wire.Mode;

/** What the motion executor is doing. */
public final class MotionStatus {
    /** Id of the running motion; 0: none. */
    public final long id;
    /** Index of its current item. */
    public final int item;
    /** Number of waiting programs. */
    public final int waiting;
    /** Control mode of the running motion; position control while none is running. */
    public final Mode mode;

    public MotionStatus(long id, int item, int waiting, Mode mode) {
        this.id = id;
        this.item = item;
        this.waiting = waiting;
        this.mode = mode;
    }

    /** Provides the current status. */
    public interface Source {
        MotionStatus status();
    }
}
