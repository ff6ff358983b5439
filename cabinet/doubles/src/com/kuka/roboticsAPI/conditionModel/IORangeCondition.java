package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.ioModel.AbstractIO;

import heptarm.doubles.Criterion;

/** A numeric input or output lies within a range. No call of KUKA's constructor is known; this one is a guess. */
public class IORangeCondition extends Criterion {
    private final AbstractIO signal;
    private final double[] band;

    public IORangeCondition(AbstractIO signal, double low, double high) {
        if (signal == null) {
            throw new IllegalArgumentException("a signal is wanted");
        }
        this.signal = signal;
        this.band = band(low, high);
    }

    /** Place of the signal and the range; for the simulation. */
    public double[] numbers() {
        return new double[] {signal.place(), band[0], band[1]};
    }
}
