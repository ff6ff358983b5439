package com.kuka.sensitivity.controlmode;

import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;

import heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** Joint impedance. */
public final class JointImpedanceControlMode extends AbstractMotionControlMode {
    private final heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode behind;

    public JointImpedanceControlMode(double... stiffness) {
        behind = new heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode(stiffness);
    }

    @Override
    public IMotionControlMode behind() {
        return behind;
    }

    public JointImpedanceControlMode setDamping(double... values) {
        behind.setDamping(values);
        return this;
    }
}
