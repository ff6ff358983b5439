package com.kuka.roboticsAPI.motionModel.controlModeModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.seam.ImpedanceMode;

/** Base of control modes. */
public abstract class AbstractMotionControlMode implements IMotionControlMode {
    /** The mode in the plant's terms, in SI; null: position control; for the simulation. */
    public ImpedanceMode forPlant(ObjectFrame motionFrame, LBR robot) {
        throw new IllegalArgumentException("the virtual cabinet has no control mode " + getClass().getName());
    }
}
