package com.kuka.roboticsAPI.motionModel.controlModeModel;

/** Base of control modes. */
public abstract class AbstractMotionControlMode implements IMotionControlMode {
}
