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

    /** Of each axis; NaN where not set. */
    public double[] getJointVelocityRel() {
        return jointDynamics().velocity.clone();
    }

    /** See {@link #getJointVelocityRel}. */
    public double[] getJointAccelerationRel() {
        return jointDynamics().acceleration.clone();
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
