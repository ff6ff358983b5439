package com.kuka.roboticsAPI.controllerModel;

import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;

/** Called when execution is paused or resumed. */
public interface IExecutionListener {
    void onExecutionPaused(Controller controller);

    void onExecutionResumed(Controller controller, ResumeMode resumeMode);

    void onExecutionModeChanged(Controller controller, ExecutionMode mode);
}
