package heptarm.doubles;

/** Hears of an FRI session; called by the thread that ticks the plant, must not block. */
public interface FriChannel {
    /** Numbers of state and quality as FRI transmits them; latency and jitter [s]. */
    void changed(int state, int quality, double latency, double jitter);
}
