package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.ioModel.AbstractIO;

import heptarm.doubles.Criterion;

/** A boolean input or output has a value. */
public class BooleanIOCondition extends Criterion {
    private final AbstractIO signal;
    private final boolean value;

    public BooleanIOCondition(AbstractIO signal, boolean value) {
        if (signal == null) {
            throw new IllegalArgumentException("a signal is wanted");
        }
        this.signal = signal;
        this.value = value;
    }

    /** Place of the signal and the value; for the simulation. */
    public double[] numbers() {
        return new double[] {signal.place(), value ? 1 : 0};
    }
}
