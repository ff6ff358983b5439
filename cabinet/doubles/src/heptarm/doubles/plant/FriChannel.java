package heptarm.doubles.plant;

/** Receives state and quality of an FRI session; called on the realtime thread of the plant, must not block. */
public interface FriChannel {
    /** State and quality as FRI numbers them; latency and jitter [s]. */
    void changed(int state, int quality, double latency, double jitter);
}
