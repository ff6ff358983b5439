package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;

/** Hears of a container, on a thread of the cabinet. */
public interface IMotionContainerListener {
    void onStateChanged(IExecutionContainer container, ExecutionState state);

    void containerFinished(IMotionContainer container);

    void motionFinished(IMotion motion);

    void motionStarted(IMotion motion);
}
