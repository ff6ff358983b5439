package com.kuka.roboticsAPI.sensorModel;

/** The external wrench at the flange, in its axes. */
public interface SensorForExternalForce {
    ForceSensorData getSensorData();
}
