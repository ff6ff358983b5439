package com.kuka.connectivity.motionModel.smartServoLIN;

import com.kuka.connectivity.motionModel.smartServo.IServoRuntime;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

/** A running SmartServoLIN. */
public interface ISmartServoLINRuntime extends IServoRuntime {
    long setDestination(AbstractFrame destination);
}
