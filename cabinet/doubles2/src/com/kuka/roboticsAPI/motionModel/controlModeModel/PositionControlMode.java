package com.kuka.roboticsAPI.motionModel.controlModeModel;

import heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** Position control. */
public final class PositionControlMode extends AbstractMotionControlMode {
    @Override
    public IMotionControlMode behind() {
        return new heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.PositionControlMode();
    }
}
