package com.kuka.roboticsAPI.motionModel.controlModeModel;

/** Stiff position control. */
public class PositionControlMode extends AbstractMotionControlMode {
    public PositionControlMode() {
        this(true);
    }

    /** What the flag means is not known; both are the same here. */
    public PositionControlMode(boolean flag) {
    }

    @Override
    public String toString() {
        return "PositionControlMode";
    }
}
