package heptarm.core.robot;

import heptarm.core.CommandRejected;
import heptarm.wire.Mode;

/** A servo motion: a job that follows targets until it is cancelled. One thread sends the targets. */
public interface ServoJob extends MotionJob {
    /**
     * Set joint positions as the target.
     *
     * @param q [rad]
     * @param velocity velocity at the target [rad/s]; null: stop there
     */
    void follow(double[] q, double[] velocity) throws CommandRejected;

    /** Set a pose of the motion frame in the base as the target; quaternion x y z w. */
    void followPose(double[] xyz, double[] quat) throws CommandRejected;

    /** Change the parameters, not the kind, of the control mode. Any thread. */
    void changeMode(Mode mode) throws CommandRejected;
}
