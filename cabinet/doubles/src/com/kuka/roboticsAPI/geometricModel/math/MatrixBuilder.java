package com.kuka.roboticsAPI.geometricModel.math;

/** Builds a matrix element by element. */
public final class MatrixBuilder {
    private final double[][] e = new double[3][3];

    public Matrix toMatrix() {
        double[][] copy = new double[3][];
        for (int i = 0; i < 3; i++) {
            copy[i] = e[i].clone();
        }
        return new Matrix(copy);
    }

    private MatrixBuilder set(int row, int column, double value) {
        e[row][column] = value;
        return this;
    }

    public MatrixBuilder setElement00(double value) {
        return set(0, 0, value);
    }

    public MatrixBuilder setElement01(double value) {
        return set(0, 1, value);
    }

    public MatrixBuilder setElement02(double value) {
        return set(0, 2, value);
    }

    public MatrixBuilder setElement10(double value) {
        return set(1, 0, value);
    }

    public MatrixBuilder setElement11(double value) {
        return set(1, 1, value);
    }

    public MatrixBuilder setElement12(double value) {
        return set(1, 2, value);
    }

    public MatrixBuilder setElement20(double value) {
        return set(2, 0, value);
    }

    public MatrixBuilder setElement21(double value) {
        return set(2, 1, value);
    }

    public MatrixBuilder setElement22(double value) {
        return set(2, 2, value);
    }
}
