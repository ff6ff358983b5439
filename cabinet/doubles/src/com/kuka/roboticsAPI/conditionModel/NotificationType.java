package com.kuka.roboticsAPI.conditionModel;

/** When an observer is notified. */
public enum NotificationType {
    EdgesOnly, OnEnable, MissedEvents, All
}
