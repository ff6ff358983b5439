package com.kuka.connectivity.motionModel.smartServoLIN;

import com.kuka.connectivity.motionModel.smartServo.IServoRuntime;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

/** A running SmartServoLIN. */
public interface ISmartServoLINRuntime extends IServoRuntime {
    long setDestination(AbstractFrame destination);

    Frame getCurrentCartesianPosition(ObjectFrame frame);
}
