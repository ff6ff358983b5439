package com.kuka.roboticsAPI.conditionModel;

/** Action of a trigger. */
public interface ITriggerAction {
}
