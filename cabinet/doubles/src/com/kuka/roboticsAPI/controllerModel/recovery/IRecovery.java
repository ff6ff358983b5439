package com.kuka.roboticsAPI.controllerModel.recovery;

/** Whether recovery is required before the application may continue. */
public interface IRecovery {
    boolean isRecoveryRequired();
}
