package com.kuka.roboticsAPI.sensorModel;

/** The torque sensors of the joints. */
public interface SensorForMeasuredTorque {
    TorqueSensorData getSensorData();
}
