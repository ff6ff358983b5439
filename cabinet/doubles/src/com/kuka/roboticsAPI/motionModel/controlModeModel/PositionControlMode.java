package com.kuka.roboticsAPI.motionModel.controlModeModel;

/** Stiff position control. */
public class PositionControlMode extends AbstractMotionControlMode {
    @Override
    public String toString() {
        return "PositionControlMode";
    }
}
