package com.kuka.roboticsAPI.conditionModel;

/** What is done when a trigger fires. */
public interface ITriggerAction {
}
