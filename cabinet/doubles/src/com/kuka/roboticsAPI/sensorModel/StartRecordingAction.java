package com.kuka.roboticsAPI.sensorModel;

import com.kuka.roboticsAPI.conditionModel.ICallbackAction;
import com.kuka.roboticsAPI.executionModel.IFiredTriggerInfo;

/** Starts a recording when a trigger fires. */
public class StartRecordingAction implements ICallbackAction {
    private final DataRecorder recorder;

    public StartRecordingAction(DataRecorder recorder) {
        this.recorder = recorder;
    }

    @Override
    public void onTriggerFired(IFiredTriggerInfo info) {
        recorder.startRecording();
    }
}
