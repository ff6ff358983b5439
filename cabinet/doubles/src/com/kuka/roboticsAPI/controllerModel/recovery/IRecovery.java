package com.kuka.roboticsAPI.controllerModel.recovery;

/** Whether something has to be done before the application may go on. */
public interface IRecovery {
    boolean isRecoveryRequired();
}
