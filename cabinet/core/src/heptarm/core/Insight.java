package heptarm.core;

/** What a simulated robot can tell and the cabinet's API cannot; found on the class path, absent on a robot. */
public interface Insight {
    /** Commanded torques [Nm]. */
    void readTorques(double[] commanded);

    /** Progress of the running motion in [0, 1] and its remaining time [s]. */
    void readProgress(double[] progressAndRemaining);

    /** Bits of the safety state that the API does not tell: the brakes. */
    int safetyBits();

    /** Cancels everything; every axis brakes as hard as it may. */
    void stopFast();
}
