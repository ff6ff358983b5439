package com.kuka.roboticsAPI.executionModel;

import com.kuka.roboticsAPI.conditionModel.ICondition;

/** Which condition ended a motion. */
public interface IFiredConditionInfo {
    ICondition getFiredCondition();
}
