package com.kuka.roboticsAPI.executionModel;

/** Which condition ended a motion. */
public interface IFiredConditionInfo {
}
