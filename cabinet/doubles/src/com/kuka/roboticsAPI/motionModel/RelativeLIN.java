package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

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
}
