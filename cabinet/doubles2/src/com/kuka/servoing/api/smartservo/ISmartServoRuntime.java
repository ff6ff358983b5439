package com.kuka.servoing.api.smartservo;

import com.kuka.device.common.JointPosition;
import com.kuka.geometry.Frame;
import com.kuka.servoing.api.common.EServoRequestState;

/** A running SmartServo motion; as in the newer version it reports by a value whether a target was taken. */
public interface ISmartServoRuntime {
    EServoRequestState setDestination(JointPosition target);

    EServoRequestState setDestination(Frame target);
}
