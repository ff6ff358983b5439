package com.kuka.roboticsAPI.motionModel.controlModeModel;

import heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** A control mode. */
public abstract class AbstractMotionControlMode {
    public abstract IMotionControlMode behind();
}
