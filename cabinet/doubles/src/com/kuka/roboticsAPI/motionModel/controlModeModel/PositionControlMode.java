package com.kuka.roboticsAPI.motionModel.controlModeModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.seam.ImpedanceMode;

/** Stiff position control. */
public class PositionControlMode extends AbstractMotionControlMode {
    public PositionControlMode() {
        this(true);
    }

    /** The meaning of the flag is not known; it has no effect here. */
    public PositionControlMode(boolean flag) {
    }

    @Override
    public ImpedanceMode forPlant(ObjectFrame motionFrame, LBR robot) {
        return null;
    }

    @Override
    public String toString() {
        return "PositionControlMode";
    }
}
