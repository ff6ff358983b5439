package com.kuka.roboticsAPI.executionModel;

/** State of an execution. */
public enum ExecutionState {
    Created, Scheduled, Executing, Finished, Cancelled, Error
}
