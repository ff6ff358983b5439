package com.kuka.roboticsAPI.motionModel;

import java.util.List;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

/** Motions commanded together; settings of the batch apply to those motions that have none of their own. */
public class MotionBatch extends RobotMotion<MotionBatch> {
    private final List<RobotMotion<?>> motions;

    public MotionBatch(RobotMotion<?>... motions) {
        if (motions.length == 0) {
            throw new IllegalArgumentException("a batch must have at least one motion");
        }
        this.motions = List.of(motions);
    }

    public List<RobotMotion<?>> getMotions() {
        return motions;
    }

    @Override
    public List<RobotMotion<?>> parts() {
        return motions;
    }

    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.BATCH;
    }
}
