package heptarm.core;

/** The cabinet's time: the machine's on a real robot, the simulated robot's in the virtual cabinet. */
public interface Clock {
    /** Cabinet time [ns], monotonic. */
    long nanos();

    /**
     * Sleeps until a cabinet time.
     *
     * @return the cabinet time of the wake-up [ns], at least the requested one
     */
    long sleepUntil(long nanos) throws InterruptedException;

    /** Cabinet seconds per wall-clock second; scales time-outs of the link. */
    double rate();
}
