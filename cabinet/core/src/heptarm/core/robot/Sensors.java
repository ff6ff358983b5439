package heptarm.core.robot;

import heptarm.wire.JointState;
import heptarm.wire.Pose;
import heptarm.wire.PoseState;
import heptarm.wire.TorqueState;
import heptarm.wire.WrenchState;

/** Measured and commanded state of the robot, in SI units. A reading may take milliseconds; any thread may make one. */
public interface Sensors {
    /** Read the joint positions; the velocities are NaN, the robot provides none. */
    JointState readJoints(long stamp);

    /** Read the joint torques; NaN where the robot provides none. */
    TorqueState readTorques(long stamp);

    /** Read the pose of the motion frame in the robot's base. */
    PoseState readPose(long stamp);

    /** Read the external wrench at the motion frame, in the axes of the base. */
    WrenchState readWrench(long stamp);

    /** Read it in the axes of another frame: "" or "tool" (the motion frame), "flange", "base" or a frame's name; or of a pose in the base. */
    WrenchState readWrench(String frame, Pose axes, long stamp);

    /** Read the progress of the current motion in [0, 1] and its remaining time [s]; NaN where the robot provides none. */
    void readProgress(double[] progressAndRemaining);
}
