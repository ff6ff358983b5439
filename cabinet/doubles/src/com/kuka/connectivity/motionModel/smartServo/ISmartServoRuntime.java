package com.kuka.connectivity.motionModel.smartServo;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

/** A running SmartServo, which accepts destinations. */
public interface ISmartServoRuntime extends IServoRuntime {
    long setDestination(JointPosition destination);

    /** A destination and the velocity to pass it at [rad/s]. */
    long setDestination(JointPosition destination, JointPosition velocity);

    long setDestination(AbstractFrame destination);

    /** A destination given in the axes of a reference. */
    long setDestination(Frame destination, AbstractFrame reference);

    void activateVelocityPlanning(boolean active);

    long getTimeStampOfSetRealtimeDestination();

    Frame getCurrentCartesianPosition(ObjectFrame frame);

    double[] getAxisTauExtMsr();

    String getFineIpoState();
}
