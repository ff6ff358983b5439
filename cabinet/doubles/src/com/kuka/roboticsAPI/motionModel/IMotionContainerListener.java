package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;

/** Called on changes of a container, in a thread of the cabinet. */
public interface IMotionContainerListener {
    void onStateChanged(IExecutionContainer container, ExecutionState state);

    void containerFinished(IMotionContainer container);

    void motionFinished(IMotion motion);

    void motionStarted(IMotion motion);
}
