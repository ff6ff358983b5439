package com.kuka.roboticsAPI.motionModel.controlModeModel;

/** How a motion is controlled. */
public interface IMotionControlMode {
}
