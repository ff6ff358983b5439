package com.kuka.roboticsAPI.motionModel;

import java.util.List;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

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
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.SPLINE_JOINTS;
    }
}
