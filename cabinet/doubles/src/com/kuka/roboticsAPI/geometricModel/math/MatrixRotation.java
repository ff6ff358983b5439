package com.kuka.roboticsAPI.geometricModel.math;

/** A rotation matrix. */
public final class MatrixRotation extends Matrix {
    private MatrixRotation(double[][] e) {
        super(e);
    }

    public static MatrixRotation of(Matrix matrix) {
        return new MatrixRotation(matrix.e);
    }
}
