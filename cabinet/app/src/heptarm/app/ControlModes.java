package heptarm.app;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.geometricModel.CartPlane;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianSineImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;

import heptarm.core.CommandRejected;
import heptarm.core.robot.GuidedSpeed;
import heptarm.wire.CartesianImpedance;
import heptarm.wire.JointImpedance;
import heptarm.wire.Mode;
import heptarm.wire.SineImpedance;
import heptarm.wire.SpiralPattern;

/** Builds Sunrise control modes from those of the protocol. */
final class ControlModes {
    /** Sunrise's names of the protocol's directions: along x y z, then about x y z. */
    private static final CartDOF[] DIRECTIONS = {CartDOF.X, CartDOF.Y, CartDOF.Z, CartDOF.C, CartDOF.B, CartDOF.A};
    /** Limit for a direction without one, where another direction has one [N, Nm, mm, rad, ...]. */
    private static final double UNLIMITED = 1e6;

    private final SunriseTools tools;

    ControlModes(SunriseTools tools) {
        this.tools = tools;
    }

    /** Refuses a mode whose axes are not available with a motion frame. */
    void check(Mode mode, ObjectFrame moved, String path) throws CommandRejected {
        String at = path;
        CartesianImpedance spring = null;
        if (mode instanceof SineImpedance) {
            at = path + "base.";
            spring = ((SineImpedance) mode).base;
        } else if (mode instanceof CartesianImpedance) {
            spring = (CartesianImpedance) mode;
        }
        if (spring != null) {
            tools.checkAxes(spring.frame, moved, at + "frame");
        }
    }

    /** Build the Sunrise mode of a checked one; null: position control. */
    AbstractMotionControlMode of(Mode mode) throws CommandRejected {
        if (mode instanceof JointImpedance) {
            JointImpedance spring = (JointImpedance) mode;
            JointImpedanceControlMode joints = new JointImpedanceControlMode(spring.stiffness.length);
            joints.setStiffness(spring.stiffness);
            joints.setDamping(spring.damping);
            return joints;
        }
        if (mode instanceof CartesianImpedance) {
            CartesianImpedanceControlMode spring = new CartesianImpedanceControlMode();
            set(spring, (CartesianImpedance) mode);
            return spring;
        }
        if (mode instanceof SineImpedance) {
            CartesianSineImpedanceControlMode pattern = new CartesianSineImpedanceControlMode();
            set(pattern, ((SineImpedance) mode).base);
            set(pattern, (SineImpedance) mode);
            return pattern;
        }
        if (mode instanceof SpiralPattern) {
            SpiralPattern spiral = (SpiralPattern) mode;
            return CartesianSineImpedanceControlMode.createSpiralPattern(CartPlane.valueOf(spiral.plane.name()), spiral.frequency,
                    spiral.amplitude, spiral.stiffness, spiral.total_time);
        }
        return new PositionControlMode();
    }

    private void set(CartesianImpedanceControlMode spring, CartesianImpedance from) throws CommandRejected {
        for (int i = 0; i < DIRECTIONS.length; i++) {
            spring.parametrize(DIRECTIONS[i]).setStiffness(from.stiffness[i]);
            spring.parametrize(DIRECTIONS[i]).setDamping(from.damping[i]);
            spring.parametrize(DIRECTIONS[i]).setAdditionalControlForce(from.additional_force[i]);
        }
        spring.setNullSpaceStiffness(from.nullspace_stiffness);
        spring.setNullSpaceDamping(from.nullspace_damping);
        if (limits(from.max_force)) {
            double[] most = six(from.max_force, false);
            spring.setMaxControlForce(most[0], most[1], most[2], most[3], most[4], most[5], from.max_force_stops);
        }
        double[] stops = GuidedSpeed.stops(from);
        if (limits(stops)) {
            double[] most = six(stops, true);
            spring.setMaxCartesianVelocity(most[0], most[1], most[2], most[3], most[4], most[5]);
        }
        if (limits(from.max_deviation)) {
            double[] most = six(from.max_deviation, true);
            spring.setMaxPathDeviation(most[0], most[1], most[2], most[3], most[4], most[5]);
        }
        AbstractFrame axes = tools.reference(from.frame);
        if (axes != null) {
            spring.setReferenceSystem(axes);
        }
    }

    private static void set(CartesianSineImpedanceControlMode pattern, SineImpedance from) {
        for (int i = 0; i < DIRECTIONS.length; i++) {
            pattern.parametrize(DIRECTIONS[i]).setAmplitude(from.amplitude[i]);
            pattern.parametrize(DIRECTIONS[i]).setFrequency(from.frequency[i]);
            pattern.parametrize(DIRECTIONS[i]).setPhaseDeg(Math.toDegrees(from.phase[i]));
            pattern.parametrize(DIRECTIONS[i]).setBias(from.bias[i]);
            if (!Double.isNaN(from.force_limit[i])) {
                pattern.parametrize(DIRECTIONS[i]).setForceLimit(from.force_limit[i]);
            }
            if (!Double.isNaN(from.position_limit[i])) {
                double most = i < 3 ? Convert.toMillimetres(from.position_limit[i]) : from.position_limit[i];
                pattern.parametrize(DIRECTIONS[i]).setPositionLimit(most);
            }
        }
        if (!Double.isNaN(from.total_time)) {
            pattern.setTotalTime(from.total_time);
        }
        if (from.rise_time > 0) {
            pattern.setRiseTime(from.rise_time);
        }
        if (!Double.isNaN(from.hold_time)) {
            pattern.setHoldTime(from.hold_time);
        }
        if (from.fall_time > 0) {
            pattern.setFallTime(from.fall_time);
        }
        pattern.setStayActiveUntilPatternFinished(from.stay_active);
    }

    /** Whether any direction has a limit. */
    private static boolean limits(double[] values) {
        for (int i = 0; i < values.length; i++) {
            if (!Double.isNaN(values[i])) {
                return true;
            }
        }
        return false;
    }

    /** Limits in Sunrise's order x y z a b c, lengths in millimetres. */
    private static double[] six(double[] values, boolean lengths) {
        double[] result = new double[values.length];
        for (int i = 0; i < values.length; i++) {
            double value = lengths && i < 3 ? Convert.toMillimetres(values[i]) : values[i];
            result[i < 3 ? i : 8 - i] = Double.isNaN(value) ? UNLIMITED : value;
        }
        return result;
    }
}
