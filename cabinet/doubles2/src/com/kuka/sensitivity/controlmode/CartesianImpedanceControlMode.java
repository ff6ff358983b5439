package com.kuka.sensitivity.controlmode;

import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartDOF;

import heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** Cartesian impedance. */
public final class CartesianImpedanceControlMode extends AbstractMotionControlMode {
    private final heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode behind =
            new heptarm.sunrise1.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode();

    @Override
    public IMotionControlMode behind() {
        return behind;
    }

    /** Parameters of directions. */
    public final class Parameters {
        private final heptarm.sunrise1.roboticsAPI.geometricModel.CartDOF direction;

        private Parameters(CartDOF direction) {
            this.direction = heptarm.sunrise1.roboticsAPI.geometricModel.CartDOF.valueOf(direction.name());
        }

        public Parameters setStiffness(double value) {
            behind.parametrize(direction).setStiffness(value);
            return this;
        }

        public Parameters setDamping(double value) {
            behind.parametrize(direction).setDamping(value);
            return this;
        }
    }

    public Parameters parametrize(CartDOF direction) {
        return new Parameters(direction);
    }

    public CartesianImpedanceControlMode setNullSpaceStiffness(double value) {
        behind.setNullSpaceStiffness(value);
        return this;
    }
}
