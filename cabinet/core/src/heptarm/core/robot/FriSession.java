package heptarm.core;

import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;

/** An open FRI session of the robot. */
public interface Fri {
    /** Holds the position with an overlay that the session's client commands; until it is cancelled. */
    Job command(Job.Listener listener) throws Refusal;

    /** Ends the session. */
    void close();

    /** Hears of a session. Called from threads of the robot; must not block. */
    interface Listener {
        void changed(FriSessionState state, FriQuality quality);
    }
}
