package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.ioModel.AbstractIO;

import heptarm.doubles.motion.AbstractCondition;
import heptarm.doubles.seam.Condition;
import heptarm.doubles.seam.SignalIs;

/** A boolean input or output has a value. */
public class BooleanIOCondition extends AbstractCondition {
    private final AbstractIO signal;
    private final boolean value;

    public BooleanIOCondition(AbstractIO signal, boolean value) {
        if (signal == null) {
            throw new IllegalArgumentException("signal must not be null");
        }
        this.signal = signal;
        this.value = value;
    }

    @Override
    protected Condition forPlant(LBR robot) {
        SignalIs is = new SignalIs();
        is.place = signal.place();
        is.value = value;
        return is;
    }
}
