package com.kuka.roboticsAPI.executionModel;

/** Something that the cabinet executes. */
public interface IExecutionContainer {
    boolean isFinished();

    boolean hasError();

    ExecutionState getState();
}
