package com.kuka.roboticsAPI.motionModel;

import java.util.List;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.Batch;
import heptarm.doubles.seam.PlantMotion;

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
    public PlantMotion describe(MotionTranslator to) {
        Batch motion = new Batch();
        motion.motions = to.parts(motions);
        motion.dynamics = jointDynamics();
        motion.blending = blending();
        return motion;
    }
}
