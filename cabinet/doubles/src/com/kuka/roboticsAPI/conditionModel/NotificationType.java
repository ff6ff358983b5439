package com.kuka.roboticsAPI.conditionModel;

/** When an observer is told. */
public enum NotificationType {
    EdgesOnly, OnEnable, MissedEvents, All
}
