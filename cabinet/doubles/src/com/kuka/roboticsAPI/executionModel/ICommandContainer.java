package com.kuka.roboticsAPI.executionModel;

import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;

import com.kuka.roboticsAPI.commandModel.ICommandRuntimeData;
import com.kuka.roboticsAPI.commandModel.IControllerCommand;

/** A running command. */
public interface ICommandContainer extends IExecutionContainer {
    void cancel();

    void await();

    void await(long time, TimeUnit unit) throws TimeoutException;

    /** Throws if the command could not be planned or has failed. */
    void validate();

    String getErrorMessage();

    IControllerCommand getCommand();

    ICommandRuntimeData getRuntimeData();
}
