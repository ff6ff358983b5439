package com.kuka.roboticsAPI.controllerModel;

/** How programs are executed. */
public enum ExecutionMode {
    Automatic, Step
}
