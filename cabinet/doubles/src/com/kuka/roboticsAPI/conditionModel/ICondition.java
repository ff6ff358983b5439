package com.kuka.roboticsAPI.conditionModel;

/** A condition, monitored while a motion runs. */
public interface ICondition {
    ICondition or(ICondition... others);

    ICondition and(ICondition... others);

    ICondition xor(ICondition other);

    ICondition invert();
}
