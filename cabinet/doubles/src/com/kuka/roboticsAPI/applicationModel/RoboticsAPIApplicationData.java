package com.kuka.roboticsAPI.applicationModel;

/** Former name of IApplicationData's class; only the name is known. */
public abstract class RoboticsAPIApplicationData implements IApplicationData {
}
