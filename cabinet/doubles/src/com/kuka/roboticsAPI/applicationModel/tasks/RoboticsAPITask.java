package com.kuka.roboticsAPI.applicationModel.tasks;

import com.kuka.roboticsAPI.RoboticsAPIContext;
import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.conditionModel.ObserverManager;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.recovery.IRecovery;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.deviceModel.Robot;
import com.kuka.roboticsAPI.uiModel.IApplicationUI;
import com.kuka.task.ITaskLogger;
import com.kuka.task.ITaskManager;

import heptarm.doubles.runtime.ApplicationServices;
import heptarm.doubles.runtime.Station;

/** Base of applications and background tasks: initialize, run, dispose. */
public abstract class RoboticsAPITask {
    private final ApplicationServices desk = ApplicationServices.current();

    public void initialize() {
    }

    public abstract void run() throws Exception;

    public void dispose() {
    }

    public ITaskLogger getLogger() {
        return desk.logger;
    }

    public RoboticsAPIContext getContext() {
        return Station.current().context;
    }

    public IApplicationData getApplicationData() {
        return desk;
    }

    public IApplicationControl getApplicationControl() {
        return desk;
    }

    public IApplicationUI getApplicationUI() {
        return desk.pad;
    }

    public ObserverManager getObserverManager() {
        return desk.observers;
    }

    /** Recovery before the application may continue; never required, since the simulated arm stays on its path. */
    public IRecovery getRecovery() {
        return () -> false;
    }

    /** The cabinet; there is only one, so the name has no effect. */
    public Controller getController(String name) {
        return Station.current().controller;
    }

    /** The robot; there is only one, so the name has no effect. */
    public Robot getRobot(Controller controller, String name) {
        return Station.current().robot;
    }

    /** Likewise. */
    public Device getDevice(Controller controller, String name) {
        return Station.current().robot;
    }

    public ITaskManager getTaskManager() {
        return Station.current().tasks;
    }

    /** A function of a background task; calls fail while no such task runs. */
    public <T> T getTaskFunction(Class<T> type) {
        return Station.current().tasks.function(type);
    }
}
