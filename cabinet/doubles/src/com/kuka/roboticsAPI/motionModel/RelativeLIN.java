package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.LinRel;
import heptarm.doubles.seam.PlantMotion;

/** Straight line relative to the pose of the motion frame at the start. */
public class RelativeLIN extends SplineMotionCP<RelativeLIN> {
    private final Transformation offset;
    private final AbstractFrame reference;

    public RelativeLIN(ITransformation offset, AbstractFrame reference) {
        this.offset = Transformation.of(offset);
        this.reference = reference;
    }

    public Transformation getOffset() {
        return offset;
    }

    /** Frame whose axes the offset refers to; null: the motion frame. */
    public AbstractFrame getReference() {
        return reference;
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        LinRel motion = new LinRel();
        if (to.isOnFlange(reference)) { // it moves with the arm, which will be elsewhere when the motion runs: use the motion frame's axes
            Transformation seen = to.motionFrame().transformationTo(reference);
            Transformation turn = Transformation.ofRad(0, 0, 0, seen.getAlphaRad(), seen.getBetaRad(), seen.getGammaRad());
            motion.offset = MotionTranslator.place(turn.compose(offset).compose(turn.invert()));
        } else {
            motion.offset = MotionTranslator.place(offset);
            motion.axes = MotionTranslator.axes(reference);
        }
        motion.dynamics = cartesianDynamics();
        motion.joints = jointDynamics();
        motion.orientation = orientation();
        motion.blending = blending();
        return motion;
    }
}
