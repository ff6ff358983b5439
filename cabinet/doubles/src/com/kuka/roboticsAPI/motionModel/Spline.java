package com.kuka.roboticsAPI.motionModel;

import java.util.List;

/** A Cartesian spline block: segments without a stop between them. */
public class Spline extends SplineMotionCP<Spline> {
    private final List<SplineMotionCP<?>> segments;

    public Spline(SplineMotionCP<?>... segments) {
        if (segments.length == 0) {
            throw new IllegalArgumentException("a spline must have at least one segment");
        }
        this.segments = List.of(segments);
    }

    /** For the simulation. */
    public List<SplineMotionCP<?>> segments() {
        return segments;
    }
}
