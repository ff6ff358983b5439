package com.kuka.roboticsAPI.motionModel;

import java.util.List;

/** A spline block in joint space. */
public class SplineJP extends SplineMotionJP<SplineJP> {
    private final List<SplineMotionJP<?>> segments;

    public SplineJP(SplineMotionJP<?>... segments) {
        if (segments.length == 0) {
            throw new IllegalArgumentException("a spline must have at least one segment");
        }
        this.segments = List.of(segments);
    }

    /** For the simulation. */
    public List<SplineMotionJP<?>> segments() {
        return segments;
    }
}
