package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;
import heptarm.doubles.seam.Spl;

/** Curved segment of a spline, to a frame. */
public class SPL extends SplineMotionCP<SPL> {
    private final AbstractFrame destination;

    public SPL(AbstractFrame destination) {
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        Spl motion = new Spl();
        motion.target = to.pose(destination);
        motion.dynamics = cartesianDynamics();
        motion.joints = jointDynamics();
        motion.orientation = orientation();
        return motion;
    }
}
