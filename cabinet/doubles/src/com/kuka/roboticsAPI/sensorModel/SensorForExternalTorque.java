package com.kuka.roboticsAPI.sensorModel;

/** The joint torques that contacts cause. */
public interface SensorForExternalTorque {
    TorqueSensorData getSensorData();
}
