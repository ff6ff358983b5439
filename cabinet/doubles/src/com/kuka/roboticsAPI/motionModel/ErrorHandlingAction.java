package com.kuka.roboticsAPI.motionModel;

/** What happens after an asynchronous motion has failed. */
public enum ErrorHandlingAction {
    Ignore, PauseMotion, EndApplication
}
