package com.kuka.roboticsAPI.motionModel.controlModeModel;

/** Stiff position control. */
public class PositionControlMode extends AbstractMotionControlMode {
    public PositionControlMode() {
        this(true);
    }

    /** The meaning of the flag is not known; it has no effect here. */
    public PositionControlMode(boolean flag) {
    }

    @Override
    public String toString() {
        return "PositionControlMode";
    }
}
