package com.kuka.roboticsAPI.applicationModel;

/** State of an application. */
public enum RoboticsAPIApplicationState {
    RUNNING, MOTIONPAUSING, RESUMING, STOPPING
}
