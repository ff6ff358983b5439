package com.kuka.connectivity.motionModel.smartServo;

import com.kuka.roboticsAPI.deviceModel.JointPosition;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;
import heptarm.doubles.seam.ServoSmart;

/** Plans a limited trajectory to each destination, far or near. The start position must be the current one. */
public class SmartServo extends ServoMotionJP<SmartServo> {
    private final JointPosition start;

    public SmartServo(JointPosition start) {
        this.start = new JointPosition(start);
    }

    @Override
    public ISmartServoRuntime getRuntime() {
        return running(true);
    }

    @Override
    public ISmartServoRuntime getRuntime(boolean waitForActivation) {
        return running(waitForActivation);
    }

    /** The first axis's; 1 if it is not set. */
    public double getJointVelocityRel() {
        return setOr1(jointDynamics().velocity[0]);
    }

    /** See {@link #getJointVelocityRel}. */
    public double getJointAccelerationRel() {
        return setOr1(jointDynamics().acceleration[0]);
    }

    private static double setOr1(double value) {
        return Double.isNaN(value) ? 1.0 : value;
    }

    public JointPosition getStart() {
        return new JointPosition(start);
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        ServoSmart motion = new ServoSmart();
        motion.timing = timing();
        motion.dynamics = jointDynamics();
        return motion;
    }
}
