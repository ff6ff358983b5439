package heptarm.doubles;

/** The simulated robot, implemented in Python. Methods may be called from any thread. */
public interface Plant {
    String title();

    /** q_min, q_max [rad], dq_max [rad/s], tau_max [Nm], seven each. */
    double[] limits();

    /** Plans and queues an order; null if that worked, otherwise what is wrong with it, in Sunrise's words. */
    String submit(MotionOrder order);

    void cancel(long id);

    void cancelAll();

    /** Cancels everything; what runs leaves its path, every axis brakes as hard as it may. */
    void stopFast();

    void pause();

    void resume();

    /** Acknowledges errors whose cause has gone. */
    void acknowledge();

    /** Lowers the override at the smartPAD to at most this. */
    void clipManualOverride(double most);

    /** Changes the parameters of a running order's control mode, see {@link MotionOrder#mode}. */
    void changeMode(long id, double[] mode);

    /**
     * Watches a condition (see {@link ConditionOrder}) until {@link #unwatch}, whatever moves; returns its number, never 0.
     *
     * @param atOnce tell, too, if it holds already
     */
    long watch(double[] condition, boolean atOnce, ConditionListener listener);

    void unwatch(long number);

    /** Place of a signal in the IO image, see {@link Ring#signal}; made where there is none yet. */
    int signal(String name, boolean output);

    /**
     * Joint positions [rad] that bring the flange to a pose in the base, nearest to others; null if there are none.
     *
     * @param redundancy E1, status and turn; NaN and -1: not given
     */
    double[] inverse(double[] pose, double[] redundancy, double[] near);

    /**
     * Opens an FRI session to a client; returns its number.
     *
     * @param signals those that the client sees
     * @param settings send period [ms], receive multiplier, port on the client, own port (-1: chosen)
     */
    long friOpen(String host, int[] settings, String[] transformations, FriSignal[] signals, FriChannel channel);

    void friClose(long session);

    /** What the controller believes to hang on the flange: mass, centre of mass, inertia as in {@link Burden#of}. */
    void carries(double[] body);

    /** Lengths base-shoulder, shoulder-elbow, elbow-wrist, wrist-flange [m]. */
    double[] links();
}
