package heptarm.core.robot;

import heptarm.core.CommandRejected;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;

/** An open FRI session of the robot. */
public interface FriSession {
    /** Starts a position hold with an overlay that the FRI client commands; it lasts until it is cancelled. */
    MotionJob command(MotionJob.Listener listener) throws CommandRejected;

    void close();

    /** Receives changes of a session in the robot's threads; must not block. */
    interface Listener {
        void changed(FriSessionState state, FriQuality quality);
    }
}
