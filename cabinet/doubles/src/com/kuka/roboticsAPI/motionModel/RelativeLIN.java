package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.LinRel;
import heptarm.doubles.seam.PlantMotion;

/** Straight line relative to the pose of the motion frame at the start. */
public class RelativeLIN extends RelativeSplineMotionCP<RelativeLIN> {
    public RelativeLIN(ITransformation offset, AbstractFrame reference) {
        super(offset, reference);
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        Transformation offset = getOffset();
        AbstractFrame reference = getReference();
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
