package heptarm.core.robot;

import heptarm.wire.CartesianImpedance;
import heptarm.wire.RobotInfo;

/** Speeds of an arm that a person moves, where the motion or the control mode names none. */
public final class GuidedSpeed {
    /** Of the motion frame [m/s]. */
    public static final double ALONG = 0.25;
    /** Fraction of the slowest axis' maximum. */
    private static final double AXIS = 0.5;
    /** A direction of less stiffness can be guided [N/m, Nm/rad]. */
    private static final double[] LEAST_STIFFNESS = {10.0, 10.0, 10.0, 0.5, 0.5, 0.5};
    /** Velocities of such directions that stop the motion [m/s, rad/s]: a quarter above those to which a hand brings the arm. */
    private static final double[] STOPS = {1.25 * ALONG, 1.25 * ALONG, 1.25 * ALONG, 1.25, 1.25, 1.25};

    private GuidedSpeed() {
    }

    /** Highest speed of every axis [rad/s]. */
    public static double ofAxes(RobotInfo robot) {
        double slowest = robot.dq_max[0];
        for (double speed : robot.dq_max) {
            slowest = Math.min(slowest, speed);
        }
        return AXIS * slowest;
    }

    /** Velocities that stop a motion in a mode [m/s, rad/s]: the mode's, and those of directions without stiffness; NaN: none. */
    public static double[] stops(CartesianImpedance mode) {
        double[] found = mode.max_velocity.clone();
        for (int i = 0; i < found.length; i++) {
            if (Double.isNaN(found[i]) && mode.stiffness[i] < LEAST_STIFFNESS[i]) {
                found[i] = STOPS[i];
            }
        }
        return found;
    }
}
