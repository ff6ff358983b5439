package com.kuka.roboticsAPI.motionModel;

import java.util.List;

/** Motions commanded together; settings of the batch apply to those motions that have none of their own. */
public class MotionBatch extends RobotMotion<MotionBatch> {
    private final List<RobotMotion<?>> motions;

    public MotionBatch(RobotMotion<?>... motions) {
        if (motions.length == 0) {
            throw new IllegalArgumentException("a batch must have at least one motion");
        }
        this.motions = List.of(motions);
    }

    /** For the simulation. */
    public List<RobotMotion<?>> motions() {
        return motions;
    }
}
