package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.Lin;
import heptarm.doubles.seam.PlantMotion;

/** Straight line to a frame. */
public class LIN extends SplineMotionCP<LIN> {
    private final AbstractFrame destination;

    public LIN(AbstractFrame destination) {
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        Lin motion = new Lin();
        motion.target = to.pose(destination);
        motion.redundancy = to.redundancy(destination);
        motion.dynamics = cartesianDynamics();
        motion.joints = jointDynamics();
        motion.orientation = orientation();
        motion.blending = blending();
        return motion;
    }
}
