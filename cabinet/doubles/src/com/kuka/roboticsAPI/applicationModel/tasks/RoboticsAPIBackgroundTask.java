package com.kuka.roboticsAPI.applicationModel.tasks;

/** A task that runs beside the application. */
public abstract class RoboticsAPIBackgroundTask extends RoboticsAPITask {
}
