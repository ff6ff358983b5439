package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.executionModel.IFiredTriggerInfo;

/** The application is called, by a thread of the cabinet's. */
public interface ICallbackAction extends ITriggerAction {
    void onTriggerFired(IFiredTriggerInfo info);
}
