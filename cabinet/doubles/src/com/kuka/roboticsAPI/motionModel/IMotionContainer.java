package com.kuka.roboticsAPI.motionModel;

import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;

import com.kuka.roboticsAPI.commandModel.IControllerCommand;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;
import com.kuka.roboticsAPI.executionModel.IFiredConditionInfo;

/** A motion under way. */
public interface IMotionContainer extends IExecutionContainer {
    IMotion getCurrentMotion();

    IMotion getLastExecutedMotion();

    void cancel();

    void await();

    void await(long time, TimeUnit unit) throws TimeoutException;

    boolean isFinished();

    boolean hasError();

    String getErrorMessage();

    boolean hasFired(ICondition condition);

    IFiredConditionInfo getFiredBreakConditionInfo();

    IControllerCommand getCommand();

    ExecutionState getState();
}
