package com.kuka.roboticsAPI.applicationModel;

import com.kuka.task.ITaskLogger;

/** Base of applications. */
public abstract class RoboticsAPIApplication {
    private ITaskLogger logger;

    public void initialize() throws Exception {
    }

    public abstract void run() throws Exception;

    /** In 2.x this seems to throw checked exceptions. */
    public void dispose() throws Exception {
    }

    public ITaskLogger getLogger() {
        return logger;
    }

    /** For the doubles. */
    public void use(ITaskLogger cabinet) {
        logger = cabinet;
    }
}
