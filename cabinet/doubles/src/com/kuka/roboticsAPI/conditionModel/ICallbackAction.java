package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.executionModel.IFiredTriggerInfo;

/** Calls the application, in a thread of the cabinet. */
public interface ICallbackAction extends ITriggerAction {
    void onTriggerFired(IFiredTriggerInfo info);
}
