package heptarm.doubles;

/** The simulated robot, implemented in Python. Methods may be called from any thread. */
public interface Plant {
    String model();

    String title();

    /** q_min, q_max [rad], dq_max [rad/s], tau_max [Nm], seven each. */
    double[] limits();

    /** Plans and queues an order; null if that worked, otherwise the error's kind, a colon and its text. */
    String submit(MotionOrder order);

    void cancel(long id);

    void cancelAll();

    void pause();

    void resume();

    /** Lengths base-shoulder, shoulder-elbow, elbow-wrist, wrist-flange [m]. */
    double[] links();

    /** Joint positions of a flange pose (x y z [m], quaternion x y z w) next to {@code near}; null if there are none. */
    double[] inverse(double[] pose, double[] redundancy, double[] near);
}
