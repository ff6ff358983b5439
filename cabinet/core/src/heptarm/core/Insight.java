package heptarm.core;

/** What a simulated robot can tell and the cabinet's API cannot; found on the class path, absent on a robot. */
public interface Insight {
    /** Commanded torques [Nm]. */
    void readTorques(double[] commanded);

    /** Progress of the running motion in [0, 1] and its remaining time [s]. */
    void readProgress(double[] progressAndRemaining);
}
