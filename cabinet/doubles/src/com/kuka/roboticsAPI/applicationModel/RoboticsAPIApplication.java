package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPITask;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.deviceModel.Robot;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.runtime.Station;

/** Base of applications. */
public abstract class RoboticsAPIApplication extends RoboticsAPITask {
    public void onApplicationStateChanged(RoboticsAPIApplicationState state) {
    }

    /** What a generated {@code main} calls; here, as on a robot, it is the cabinet that runs applications. */
    public void runApplication() {
        throw new IllegalStateException("the cabinet runs applications: heptarm sim --app FOLDER --app-class "
                + getClass().getSimpleName());
    }

    /** The robot; there is one, whatever the name. */
    public Robot getRobot(Controller controller, String name) {
        return Station.current().robot;
    }

    /** A new tool or workpiece as the project's template of that name describes it. */
    public <T> T createFromTemplate(String name) {
        return getApplicationData().createFromTemplate(name);
    }

    /** A taught frame, by its path. */
    public ObjectFrame getFrame(String path) {
        return getApplicationData().getFrame(path);
    }
}
