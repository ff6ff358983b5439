package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.JointPosition;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;
import heptarm.doubles.seam.Ptp;

/** Point to point, to joint positions. */
public class PTP extends SplineMotionJP<PTP> {
    private final JointPosition destination;

    public PTP(JointPosition destination) {
        this.destination = new JointPosition(destination);
    }

    public JointPosition getDestination() {
        return new JointPosition(destination);
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        Ptp motion = new Ptp();
        motion.q = destination.get();
        motion.dynamics = jointDynamics();
        motion.blending = blending();
        return motion;
    }
}
