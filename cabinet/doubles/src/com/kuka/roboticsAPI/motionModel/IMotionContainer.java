package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.executionModel.ICommandContainer;
import com.kuka.roboticsAPI.executionModel.IFiredConditionInfo;

/** A running motion. */
public interface IMotionContainer extends ICommandContainer {
    IMotion getCurrentMotion();

    IMotion getLastExecutedMotion();

    /** Adds a motion of the same frame; the container ends with it. */
    void append(IMotion motion);

    boolean hasFired(ICondition condition);

    IFiredConditionInfo getFiredBreakConditionInfo();
}
