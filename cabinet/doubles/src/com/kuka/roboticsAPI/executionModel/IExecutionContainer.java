package com.kuka.roboticsAPI.executionModel;

/** An execution of the cabinet. */
public interface IExecutionContainer {
    boolean isFinished();

    boolean hasError();

    ExecutionState getState();
}
