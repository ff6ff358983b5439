package heptarm.app2;

import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartDOF;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;
import com.kuka.sensitivity.controlmode.CartesianImpedanceControlMode;
import com.kuka.sensitivity.controlmode.JointImpedanceControlMode;

import heptarm.core.CommandRejected;
import heptarm.core.robot.GuidedSpeed;
import heptarm.wire.CartesianImpedance;
import heptarm.wire.JointImpedance;
import heptarm.wire.Mode;
import heptarm.wire.PositionMode;

/** Builds control modes of Sunrise 2.x from those of the protocol. */
final class Sunrise2Modes {
    /** Sunrise's names of the protocol's directions: along x y z, then about x y z. */
    private static final CartDOF[] DIRECTIONS = {CartDOF.X, CartDOF.Y, CartDOF.Z, CartDOF.C, CartDOF.B, CartDOF.A};
    /** Damping of the null space where none was asked for; no public program sets it. */
    private static final double DEFAULT_NULLSPACE_DAMPING = 0.7;

    private Sunrise2Modes() {
    }

    /** Refuses a mode that this preview cannot express. */
    static void check(Mode mode, String path) throws CommandRejected {
        if (mode == null || mode instanceof PositionMode || mode instanceof JointImpedance) {
            return;
        }
        if (!(mode instanceof CartesianImpedance)) {
            throw Sunrise2Robot.unsupported(path.substring(0, path.length() - 1), mode.getClass().getSimpleName());
        }
        CartesianImpedance spring = (CartesianImpedance) mode;
        if (!spring.frame.isEmpty() && !"tool".equals(spring.frame) && !"flange".equals(spring.frame)) {
            throw Sunrise2Robot.unsupported(path + "frame", "impedance along the axes of " + spring.frame);
        }
        for (double force : spring.additional_force) {
            if (force != 0.0) {
                throw Sunrise2Robot.unsupported(path + "additional_force", "additional forces");
            }
        }
        if (spring.nullspace_damping != DEFAULT_NULLSPACE_DAMPING) {
            throw Sunrise2Robot.unsupported(path + "nullspace_damping", "another damping of the null space than 0.7");
        }
        refuse(spring.max_force, path + "max_force", "a limit of the control force");
        refuse(spring.max_deviation, path + "max_deviation", "a limit of the deviation");
        refuse(GuidedSpeed.stops(spring), path + "stiffness", "a direction without stiffness, since its speed cannot be limited");
    }

    private static void refuse(double[] limits, String parameter, String what) throws CommandRejected {
        for (double limit : limits) {
            if (!Double.isNaN(limit)) {
                throw Sunrise2Robot.unsupported(parameter, what);
            }
        }
    }

    /** Build the Sunrise mode of a checked one; null: position control. */
    static AbstractMotionControlMode of(Mode mode) {
        if (mode instanceof JointImpedance) {
            JointImpedance spring = (JointImpedance) mode;
            JointImpedanceControlMode joints = new JointImpedanceControlMode(spring.stiffness);
            joints.setDamping(spring.damping);
            return joints;
        }
        if (mode instanceof CartesianImpedance) {
            CartesianImpedance from = (CartesianImpedance) mode;
            CartesianImpedanceControlMode spring = new CartesianImpedanceControlMode();
            for (int i = 0; i < DIRECTIONS.length; i++) {
                spring.parametrize(DIRECTIONS[i]).setStiffness(from.stiffness[i]);
                spring.parametrize(DIRECTIONS[i]).setDamping(from.damping[i]);
            }
            spring.setNullSpaceStiffness(from.nullspace_stiffness);
            return spring;
        }
        return new PositionControlMode();
    }
}
