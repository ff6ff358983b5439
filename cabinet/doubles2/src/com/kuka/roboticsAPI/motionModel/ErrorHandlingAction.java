package com.kuka.roboticsAPI.motionModel;

/** What happens after an error. */
public enum ErrorHandlingAction {
    IGNORE, PAUSE_MOTION
}
