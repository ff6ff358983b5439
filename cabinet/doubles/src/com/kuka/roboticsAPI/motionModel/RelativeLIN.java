package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

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
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.LIN_REL;
        order.offset = MotionTranslator.pose(offset);
        order.reference = MotionTranslator.axes(reference);
        for (AbstractFrame one = reference; one != null; one = one.getParent()) {
            if (one == robot.getFlange()) { // it moves with the arm, which will be elsewhere when the motion runs: use the motion frame's axes
                Transformation to = motionFrame.transformationTo(reference);
                Transformation turn = Transformation.ofRad(0, 0, 0, to.getAlphaRad(), to.getBetaRad(), to.getGammaRad());
                order.offset = MotionTranslator.pose(turn.compose(offset).compose(turn.invert()));
                order.reference = null;
            }
        }
    }
}
