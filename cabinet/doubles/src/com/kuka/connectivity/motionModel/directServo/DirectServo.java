package com.kuka.connectivity.motionModel.directServo;

import com.kuka.connectivity.motionModel.smartServo.ServoMotionJP;
import com.kuka.roboticsAPI.deviceModel.JointPosition;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;
import heptarm.doubles.seam.ServoDirect;

/** Moves directly to each destination; destinations must be close and smooth. */
public class DirectServo extends ServoMotionJP<DirectServo> {
    private final JointPosition start;

    public DirectServo(JointPosition start) {
        this.start = new JointPosition(start);
    }

    @Override
    public IDirectServoRuntime getRuntime() {
        return running(true);
    }

    @Override
    public IDirectServoRuntime getRuntime(boolean waitForActivation) {
        return running(waitForActivation);
    }

    public JointPosition getStart() {
        return new JointPosition(start);
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        ServoDirect motion = new ServoDirect();
        motion.timing = timing();
        motion.dynamics = jointDynamics();
        return motion;
    }
}
