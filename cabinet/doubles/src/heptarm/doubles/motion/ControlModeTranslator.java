package heptarm.doubles.motion;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

import heptarm.doubles.seam.ImpedanceMode;

/** Converts parameters of control modes from the Sunrise API (mm, directions x y z a b c) for the plant (SI, directions x y z, about x y z). */
public final class ControlModeTranslator {
    private static final double MM = 1e-3;
    /** [N, Nm]: a larger limit is no limit. */
    private static final double UNLIMITED_FORCE = 1e6;
    /** [m, rad, m/s, rad/s]: a larger limit is no limit. */
    private static final double UNLIMITED_MOTION = 100.0;

    private ControlModeTranslator() {
    }

    /** The mode for the plant; null: position control. */
    static ImpedanceMode of(IMotionControlMode mode, ObjectFrame motionFrame, LBR robot) {
        if (mode == null) {
            return null;
        }
        if (!(mode instanceof AbstractMotionControlMode)) {
            throw new IllegalArgumentException("the virtual cabinet has no control mode " + mode.getClass().getName());
        }
        return ((AbstractMotionControlMode) mode).forPlant(motionFrame, robot);
    }

    /** Reorders x y z a b c to x y z and about x, y, z. */
    public static double[] directions(double[] v) {
        return new double[] {v[0], v[1], v[2], v[5], v[4], v[3]};
    }

    /** Limits of force and torque; NaN: unlimited. */
    public static double[] forceLimits(double[] values) {
        return limits(values, 1.0, UNLIMITED_FORCE);
    }

    /** Limits of deviation or velocity from mm to SI; NaN: unlimited. */
    public static double[] motionLimits(double[] values) {
        return limits(values, MM, UNLIMITED_MOTION);
    }

    private static double[] limits(double[] values, double unit, double unlimited) {
        double[] result = directions(values);
        for (int i = 0; i < result.length; i++) {
            result[i] *= i < 3 ? unit : 1.0;
            result[i] = result[i] >= unlimited ? Double.NaN : result[i];
        }
        return result;
    }
}
