package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPITask;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

/** Base of applications. */
public abstract class RoboticsAPIApplication extends RoboticsAPITask {
    public void onApplicationStateChanged(RoboticsAPIApplicationState state) {
    }

    /** Called by a generated {@code main}; no effect, since the cabinet runs applications. */
    public void runApplication() {
        throw new IllegalStateException("the cabinet runs applications: heptarm sim app FOLDER --app-class "
                + getClass().getSimpleName());
    }

    /** A new tool or workpiece from the project's template of that name. */
    public <T> T createFromTemplate(String name) {
        return getApplicationData().createFromTemplate(name);
    }

    /** A taught frame, by its path. */
    public ObjectFrame getFrame(String path) {
        return getApplicationData().getFrame(path);
    }
}
