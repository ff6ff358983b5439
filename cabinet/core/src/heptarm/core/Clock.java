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

    /**
     * Sleeps until the robot's state of a cabinet time can be read by {@link #hold}: on a real robot until that time. A virtual one
     * computes its state a moment sooner; {@link #awaitDue} waits for the rest.
     *
     * @return the cabinet time to hold [ns], at least the requested one
     */
    long sleepUntilReadable(long nanos) throws InterruptedException;

    /** Waits until a cabinet time that {@link #sleepUntilReadable} has returned. */
    void awaitDue(long nanos) throws InterruptedException;

    /**
     * Fixes the instant that the calling thread reads from the robot, until {@link #release}. A real robot has no past: what
     * is read there is always of the present.
     *
     * @param nanos time of the instant, at the latest the present or what {@link #sleepUntilReadable} has returned
     */
    void hold(long nanos);

    /** Ends {@link #hold}. */
    void release();

    /** Time of what the calling thread reads from now on [ns]: of the instant that it holds, or the present. */
    long stamp();

    /** Cabinet seconds per wall-clock second; scales time-outs of the link. */
    double rate();
}
