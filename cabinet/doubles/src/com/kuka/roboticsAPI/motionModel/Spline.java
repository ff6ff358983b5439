package com.kuka.roboticsAPI.motionModel;

import java.util.List;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;

/** A Cartesian spline block: segments without a stop between them. */
public class Spline extends SplineMotionCP<Spline> {
    private final List<SplineMotionCP<?>> segments;

    public Spline(SplineMotionCP<?>... segments) {
        if (segments.length == 0) {
            throw new IllegalArgumentException("a spline must have at least one segment");
        }
        this.segments = List.of(segments);
    }

    @Override
    public List<SplineMotionCP<?>> parts() {
        return segments;
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        heptarm.doubles.seam.Spline motion = new heptarm.doubles.seam.Spline();
        motion.segments = to.parts(segments);
        motion.dynamics = cartesianDynamics();
        motion.joints = jointDynamics();
        motion.orientation = orientation();
        return motion;
    }
}
