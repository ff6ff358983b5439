package heptarm.app;

import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;

import heptarm.wire.JointImpedance;
import heptarm.wire.Mode;
import heptarm.wire.PositionMode;

/** Control modes of the protocol as those of Sunrise. */
final class Modes {
    private Modes() {
    }

    static boolean isKnown(Mode mode) {
        return mode instanceof PositionMode || mode instanceof JointImpedance;
    }

    /** The Sunrise mode of a known one; null is position control. */
    static AbstractMotionControlMode of(Mode mode) {
        if (mode instanceof JointImpedance) {
            JointImpedance spring = (JointImpedance) mode;
            JointImpedanceControlMode joints = new JointImpedanceControlMode(spring.stiffness.length);
            joints.setStiffness(spring.stiffness);
            joints.setDamping(spring.damping);
            return joints;
        }
        return new PositionControlMode();
    }
}
