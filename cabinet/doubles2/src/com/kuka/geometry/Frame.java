package com.kuka.geometry;

import com.kuka.math.geometry.Transformation;

/** A frame. */
public interface Frame {
    Transformation getTransformationFromParent();
}
