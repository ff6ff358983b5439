package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;
import heptarm.doubles.seam.PtpPose;

/** Point to point, to a frame. */
public class CartesianPTP extends SplineMotionJP<CartesianPTP> {
    private final AbstractFrame destination;

    public CartesianPTP(AbstractFrame destination) {
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        PtpPose motion = new PtpPose();
        motion.target = to.pose(destination);
        motion.redundancy = to.redundancy(destination);
        motion.dynamics = jointDynamics();
        motion.blending = blending();
        return motion;
    }
}
