package com.kuka.connectivity.motionModel.smartServo;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** Operations of all running servo motions. */
public interface IServoRuntime {
    /** Updates the values of the getters; returns a time stamp [ms]. */
    long updateWithRealtimeSystem();

    boolean stopMotion();

    double getRemainingTime();

    boolean isDestinationReached();

    void changeControlModeSettings(IMotionControlMode mode);

    void setGoalReachedEventHandler(IServoOnGoalReachedEvent handler);

    JointPosition getCurrentJointDestination();

    Frame getCurrentCartesianDestination(ObjectFrame frame);

    JointPosition getAxisQMsrOnController();
}
