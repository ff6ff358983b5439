package heptarm.doubles.motion;

import java.util.Arrays;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianSineImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;

import heptarm.doubles.seam.CartesianImpedance;
import heptarm.doubles.seam.ImpedanceMode;
import heptarm.doubles.seam.JointImpedance;
import heptarm.doubles.seam.SineImpedance;

/** Translates control modes of the Sunrise API (mm, directions x y z a b c) for the plant (SI, directions x y z, about x y z). */
public final class ControlModeTranslator {
    private static final double MM = 1e-3;
    /** [N, Nm]: a larger limit is no limit. */
    private static final double UNLIMITED_FORCE = 1e6;
    /** [m, rad, m/s, rad/s]: a larger limit is no limit. */
    private static final double UNLIMITED_MOTION = 100.0;
    /** Largest stiffness that the plant takes [Nm/rad]. */
    private static final double MAX_NULLSPACE_STIFFNESS = 5000.0;

    private ControlModeTranslator() {
    }

    /** The mode for the plant; null: position control. */
    static ImpedanceMode of(IMotionControlMode mode, ObjectFrame motionFrame, LBR robot) {
        if (mode == null || mode instanceof PositionControlMode) {
            return null;
        }
        if (mode instanceof JointImpedanceControlMode) {
            JointImpedance joints = new JointImpedance();
            joints.stiffness = ((JointImpedanceControlMode) mode).getStiffness();
            joints.damping = ((JointImpedanceControlMode) mode).getDamping();
            return joints;
        }
        if (mode instanceof CartesianSineImpedanceControlMode) {
            SineImpedance sine = ((CartesianSineImpedanceControlMode) mode).pattern();
            sine.base = cartesian((CartesianImpedanceControlMode) mode, motionFrame, robot);
            return sine;
        }
        if (mode instanceof CartesianImpedanceControlMode) {
            return cartesian((CartesianImpedanceControlMode) mode, motionFrame, robot);
        }
        throw new IllegalArgumentException("the virtual cabinet has no control mode " + mode.getClass().getName());
    }

    private static CartesianImpedance cartesian(CartesianImpedanceControlMode mode, ObjectFrame motionFrame, LBR robot) {
        CartesianImpedance cartesian = new CartesianImpedance();
        cartesian.stiffness = directions(mode.getStiffness());
        cartesian.damping = directions(mode.getDamping());
        cartesian.nullspaceStiffness = Math.min(mode.getNullSpaceStiffness(), MAX_NULLSPACE_STIFFNESS);
        cartesian.nullspaceDamping = mode.getNullSpaceDamping();
        cartesian.additionalForce = directions(mode.additionalForces());
        cartesian.maxForce = forceLimits(mode.getMaxControlForce());
        cartesian.maxForceStops = mode.hasMaxControlForceStopCondition();
        cartesian.maxVelocity = motionLimits(mode.getMaxCartesianVelocity());
        cartesian.maxDeviation = motionLimits(mode.getMaxPathDeviation());
        AbstractFrame reference = mode.referenceSystem();
        if (reference != null && reference != motionFrame) {
            cartesian.axes = Arrays.copyOfRange(MotionTranslator.pose(robot.getRootFrame().transformationTo(reference)), 3, 7);
        }
        return cartesian;
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
