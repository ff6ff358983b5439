package com.kuka.connectivity.motionModel.directServo;

import com.kuka.connectivity.motionModel.smartServo.IServoRuntime;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;

/** A running DirectServo. */
public interface IDirectServoRuntime extends IServoRuntime {
    long setDestination(JointPosition destination);

    long setDestination(AbstractFrame destination);

    /** A destination given in the axes of a reference. */
    long setDestination(Frame destination, AbstractFrame reference);
}
