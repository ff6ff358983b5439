package com.kuka.roboticsAPI.motionModel.controlModeModel;

/** The mode of hand guiding motions; other motions refuse it. */
public class HandGuidingControlMode extends AbstractMotionControlMode {
    @Override
    public String toString() {
        return "HandGuidingControlMode";
    }
}
