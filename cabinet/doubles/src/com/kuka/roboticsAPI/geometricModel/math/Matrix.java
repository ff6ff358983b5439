package com.kuka.roboticsAPI.geometricModel.math;

/** A 3x3 matrix; element RC is row R, column C, from 0. */
public class Matrix {
    final double[][] e;

    Matrix(double[][] e) {
        this.e = e;
    }

    public double get(int row, int column) {
        return e[row][column];
    }

    public Vector getRow(int row) {
        return Vector.of(e[row][0], e[row][1], e[row][2]);
    }

    public double getElement00() {
        return e[0][0];
    }

    public double getElement01() {
        return e[0][1];
    }

    public double getElement02() {
        return e[0][2];
    }

    public double getElement10() {
        return e[1][0];
    }

    public double getElement11() {
        return e[1][1];
    }

    public double getElement12() {
        return e[1][2];
    }

    public double getElement20() {
        return e[2][0];
    }

    public double getElement21() {
        return e[2][1];
    }

    public double getElement22() {
        return e[2][2];
    }
}
