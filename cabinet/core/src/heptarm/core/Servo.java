package heptarm.core;

import heptarm.wire.Mode;

/** A servo motion: a job that follows targets until it is cancelled. Targets come from one thread. */
public interface Servo extends Job {
    /**
     * Takes joint positions as the target.
     *
     * @param q [rad]
     * @param velocity to pass them at [rad/s]; null: come to rest there
     */
    void follow(double[] q, double[] velocity) throws Refusal;

    /** Takes a pose of the moved frame in the base as the target; quaternion x y z w. */
    void followPose(double[] xyz, double[] quat) throws Refusal;

    /** Changes the parameters, not the kind, of the control mode. Called by any thread. */
    void change(Mode mode) throws Refusal;
}
