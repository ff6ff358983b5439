package com.kuka.roboticsAPI.controllerModel;

import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;

/** Hears of pauses of the execution. */
public interface IExecutionListener {
    void onExecutionPaused(Controller controller);

    void onExecutionResumed(Controller controller, ResumeMode resumeMode);

    void onExecutionModeChanged(Controller controller, ExecutionMode mode);
}
