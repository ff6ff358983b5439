package com.kuka.servoing.api.common;

import com.kuka.device.common.JointPosition;
import com.kuka.servoing.api.smartservo.ISmartServo;

/** Makes servo motions. */
public interface IServoingCapability {
    ISmartServo createSmartServoMotion(JointPosition start);
}
