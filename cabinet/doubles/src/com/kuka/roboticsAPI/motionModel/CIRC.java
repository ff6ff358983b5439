package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.Circ;
import heptarm.doubles.seam.PlantMotion;

/** Arc of a circle through an auxiliary point. */
public class CIRC extends SplineMotionCP<CIRC> {
    private final AbstractFrame auxiliary;
    private final AbstractFrame destination;

    public CIRC(AbstractFrame auxiliary, AbstractFrame destination) {
        this.auxiliary = auxiliary;
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        Circ motion = new Circ();
        motion.via = to.pose(auxiliary);
        motion.end = to.pose(destination);
        motion.redundancy = to.redundancy(destination);
        motion.dynamics = cartesianDynamics();
        motion.joints = jointDynamics();
        motion.orientation = orientation();
        motion.blending = blending();
        return motion;
    }
}
