package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** Straight line from where the moved frame is when the motion begins. */
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

    /** Whose axes the offset is given in; null: the moved frame's. */
    public AbstractFrame getReference() {
        return reference;
    }
}
