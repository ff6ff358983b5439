package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.ioModel.AbstractIO;

import heptarm.doubles.motion.AbstractCondition;
import heptarm.doubles.seam.Condition;
import heptarm.doubles.seam.SignalOutside;

/** A numeric input or output is within a range. No call of KUKA's constructor is known; this signature is a guess. */
public class IORangeCondition extends AbstractCondition {
    private final AbstractIO signal;
    private final double[] band;

    public IORangeCondition(AbstractIO signal, double low, double high) {
        if (signal == null) {
            throw new IllegalArgumentException("signal must not be null");
        }
        this.signal = signal;
        this.band = band(low, high);
    }

    @Override
    protected Condition forPlant(LBR robot) {
        SignalOutside outside = new SignalOutside();
        outside.place = signal.place();
        outside.low = band[0];
        outside.high = band[1];
        return not(outside);
    }
}
