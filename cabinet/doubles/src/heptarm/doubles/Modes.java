package heptarm.doubles;

import java.util.Arrays;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianSineImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;

/** Turns control modes of the Sunrise API (millimetres, directions x y z a b c) into numbers for the plant (SI, rotations about x y z). */
final class Modes {
    private static final double MM = 1e-3;
    private static final double OFF = 1e6;
    /** [m, rad, m/s, rad/s]: more than this is as good as no limit. */
    private static final double FAR = 100.0;
    private static final double STIFFEST = 5000.0;

    private double[] numbers = new double[0];

    private Modes() {
    }

    /** See {@link MotionOrder#mode}; null: position. */
    static double[] of(IMotionControlMode mode, ObjectFrame moved, LBR robot) {
        if (mode == null || mode instanceof PositionControlMode) {
            return null;
        }
        Modes all = new Modes();
        if (mode instanceof JointImpedanceControlMode) {
            all.put(1).put(((JointImpedanceControlMode) mode).getStiffness()).put(((JointImpedanceControlMode) mode).getDamping());
        } else if (mode instanceof CartesianSineImpedanceControlMode) {
            all.put(3).cartesian((CartesianImpedanceControlMode) mode, moved, robot);
            all.pattern((CartesianSineImpedanceControlMode) mode);
        } else if (mode instanceof CartesianImpedanceControlMode) {
            all.put(2).cartesian((CartesianImpedanceControlMode) mode, moved, robot);
        } else {
            throw new IllegalArgumentException("the virtual cabinet has no " + mode.getClass().getName());
        }
        return all.numbers;
    }

    private Modes put(double... more) {
        int size = numbers.length;
        numbers = Arrays.copyOf(numbers, size + more.length);
        System.arraycopy(more, 0, numbers, size, more.length);
        return this;
    }

    private void cartesian(CartesianImpedanceControlMode mode, ObjectFrame moved, LBR robot) {
        put(turned(mode.getStiffness())).put(turned(mode.getDamping()));
        put(Math.min(mode.getNullSpaceStiffness(), STIFFEST), mode.getNullSpaceDamping());
        put(turned(mode.additionalForces()));
        put(limits(mode.getMaxControlForce(), 1.0, OFF)).put(mode.hasMaxControlForceStopCondition() ? 1 : 0);
        put(limits(mode.getMaxCartesianVelocity(), MM, FAR)).put(limits(mode.getMaxPathDeviation(), MM, FAR));
        AbstractFrame reference = mode.referenceSystem();
        if (reference == null || reference == moved) {
            put(Double.NaN, Double.NaN, Double.NaN, Double.NaN);
        } else {
            put(Arrays.copyOfRange(Orders.pose(robot.getRootFrame().transformationTo(reference)), 3, 7));
        }
    }

    private void pattern(CartesianSineImpedanceControlMode mode) {
        double[][] waves = mode.waves();
        for (int i = 0; i < waves[2].length; i++) {
            waves[2][i] = Math.toRadians(waves[2][i] % 360.0);
        }
        for (int i = 0; i < 4; i++) {
            put(turned(waves[i]));
        }
        put(limits(waves[4], 1.0, OFF)).put(limits(waves[5], MM, FAR)).put(mode.times());
    }

    /** A, b, c become rotations about x, y, z. */
    private static double[] turned(double[] v) {
        return new double[] {v[0], v[1], v[2], v[5], v[4], v[3]};
    }

    /** In SI; NaN where there is none. */
    private static double[] limits(double[] values, double unit, double off) {
        double[] result = turned(values);
        for (int i = 0; i < result.length; i++) {
            result[i] *= i < 3 ? unit : 1.0;
            result[i] = result[i] >= off ? Double.NaN : result[i];
        }
        return result;
    }
}
