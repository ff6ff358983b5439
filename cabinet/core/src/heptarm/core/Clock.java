package heptarm.core;

/** The cabinet's time. On a robot it is the machine's; in the virtual cabinet it is the simulated robot's. */
public interface Clock {
    /** Cabinet time [ns], never going back. */
    long nanos();

    /**
     * Sleeps until a cabinet time.
     *
     * @return the cabinet time [ns] for which the caller was woken, at least the one asked for
     */
    long sleepUntil(long nanos) throws InterruptedException;

    /** Cabinet seconds per second of the world outside; time-outs of the link are scaled by it. */
    double rate();
}
