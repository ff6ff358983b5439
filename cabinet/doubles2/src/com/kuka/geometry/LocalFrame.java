package com.kuka.geometry;

import com.kuka.math.geometry.ITransformation;
import com.kuka.math.geometry.Transformation;

/** A frame of an application. */
public class LocalFrame implements Frame {
    private final Transformation fromParent;

    /** The only parent that the doubles know is the base of the robot. */
    public LocalFrame(Frame parent, ITransformation fromParent) {
        this.fromParent = (Transformation) fromParent;
    }

    @Override
    public Transformation getTransformationFromParent() {
        return fromParent;
    }
}
