package com.kuka.roboticsAPI.motionModel;

import java.util.List;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.JointSpline;
import heptarm.doubles.seam.PlantMotion;

/** A spline block in joint space. */
public class SplineJP extends SplineMotionJP<SplineJP> {
    private final List<SplineMotionJP<?>> segments;

    public SplineJP(SplineMotionJP<?>... segments) {
        if (segments.length == 0) {
            throw new IllegalArgumentException("a spline must have at least one segment");
        }
        this.segments = List.of(segments);
    }

    @Override
    public List<SplineMotionJP<?>> parts() {
        return segments;
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        JointSpline motion = new JointSpline();
        motion.points = to.parts(segments);
        motion.dynamics = jointDynamics();
        return motion;
    }
}
