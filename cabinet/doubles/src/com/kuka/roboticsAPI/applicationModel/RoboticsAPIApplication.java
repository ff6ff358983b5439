package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.conditionModel.ObserverManager;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.recovery.IRecovery;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.uiModel.IApplicationUI;
import com.kuka.task.ITaskLogger;

import heptarm.doubles.Desk;
import heptarm.doubles.Station;

/** Base of applications: initialize, run, dispose. */
public abstract class RoboticsAPIApplication {
    private final Desk desk = Desk.current();

    public void initialize() {
    }

    public abstract void run() throws Exception;

    public void dispose() {
    }

    public void onApplicationStateChanged(RoboticsAPIApplicationState state) {
    }

    public ITaskLogger getLogger() {
        return desk.logger;
    }

    public IApplicationData getApplicationData() {
        return desk;
    }

    public IApplicationControl getApplicationControl() {
        return desk;
    }

    /** What has to be done before the application may go on; an arm that keeps its path needs nothing. */
    public IRecovery getRecovery() {
        return () -> false;
    }

    public IApplicationUI getApplicationUI() {
        return desk.pad;
    }

    public ObserverManager getObserverManager() {
        return desk.observers;
    }

    public Controller getController(String name) {
        return Station.current().controller;
    }

    public Device getDevice(Controller controller, String name) {
        return Station.current().robot;
    }
}
