package com.kuka.roboticsAPI.conditionModel;

import heptarm.doubles.runtime.NotModelled;

/** A condition, monitored while a motion runs. */
public interface ICondition {
    ICondition or(ICondition other, ICondition... more);

    /** An application's own condition may lack it; the virtual cabinet can monitor its own conditions only. */
    default ICondition and(ICondition other, ICondition... more) {
        throw new NotModelled("to combine a condition of class " + getClass().getName());
    }

    ICondition xor(ICondition other);

    ICondition invert();
}
