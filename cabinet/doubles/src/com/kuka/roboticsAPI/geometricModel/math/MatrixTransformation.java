package com.kuka.roboticsAPI.geometricModel.math;

/** A transformation by its rotation matrix and translation; for the simulation it is the same as any other. */
public final class MatrixTransformation {
    private MatrixTransformation() {
    }

    /** The transformation with this translation and rotation. */
    public static Transformation of(Vector translation, MatrixRotation rotation) {
        return Transformation.of(translation, rotation);
    }
}
