package com.kuka.roboticsAPI.motionModel;

import java.util.List;

/** Motions that are commanded together; what is set on the batch holds for those of them that say nothing else. */
public class MotionBatch extends RobotMotion<MotionBatch> {
    private final List<RobotMotion<?>> motions;

    public MotionBatch(RobotMotion<?>... motions) {
        if (motions.length == 0) {
            throw new IllegalArgumentException("a batch has at least one motion");
        }
        this.motions = List.of(motions);
    }

    public List<RobotMotion<?>> getMotions() {
        return motions;
    }
}
