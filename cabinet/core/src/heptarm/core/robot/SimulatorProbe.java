package heptarm.core.robot;

import heptarm.wire.Pose;
import heptarm.wire.ToolInfo;

/** What a simulated robot provides and the cabinet's API does not. Found on the class path; absent on a real robot. */
public interface SimulatorProbe {
    /** Read commanded torques [Nm]. */
    void readTorques(double[] commanded);

    /** Read the progress of the current motion in [0, 1] and its remaining time [s]. */
    void readProgress(double[] progressAndRemaining);

    /** Bits of the safety state that the API does not provide: the brakes. */
    int safetyBits();

    /** Cancels everything; every axis brakes at its limit. */
    void stopFast();

    /**
     * Mounts shapes on the flange, in place of those before; they collide.
     *
     * @param tool with shapes in the flange frame; null: none
     * @param workpiece with shapes in the frame that holds it; null: none
     * @param holding pose of that frame in the flange frame
     */
    void mount(ToolInfo tool, ToolInfo workpiece, Pose holding);
}
