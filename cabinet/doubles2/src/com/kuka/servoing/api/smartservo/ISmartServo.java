package com.kuka.servoing.api.smartservo;

import java.util.concurrent.TimeUnit;

import com.kuka.motion.IMotion;

/** A SmartServo motion. */
public interface ISmartServo extends IMotion {
    ISmartServo setMinimumTrajectoryExecutionTime(double seconds);

    ISmartServo setJointVelocityRel(double value);

    ISmartServo setJointAccelerationRel(double value);

    ISmartServoRuntime getRuntime(long time, TimeUnit unit);
}
