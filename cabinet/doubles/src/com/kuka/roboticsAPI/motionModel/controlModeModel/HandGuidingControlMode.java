package com.kuka.roboticsAPI.motionModel.controlModeModel;

/** Control mode of hand guiding motions; refused by other motions. */
public class HandGuidingControlMode extends AbstractMotionControlMode {
    @Override
    public String toString() {
        return "HandGuidingControlMode";
    }
}
