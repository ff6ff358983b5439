package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.motion.AbstractCondition;
import heptarm.doubles.seam.Condition;

/** Holds when another condition does not. */
public class NotCondition extends AbstractCondition {
    private final ICondition condition;

    public NotCondition(ICondition condition) {
        this.condition = condition;
    }

    @Override
    protected Condition forPlant(LBR robot) {
        return not(translate(condition, robot));
    }
}
