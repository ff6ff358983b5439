package com.kuka.roboticsAPI.controllerModel;

/** Execution of motions. */
public interface IExecutionService {
    void cancelAll();
}
