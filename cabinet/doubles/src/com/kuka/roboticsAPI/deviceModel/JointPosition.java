package com.kuka.roboticsAPI.deviceModel;

import java.util.Arrays;

/** Joint positions [rad]. Mutable. */
public class JointPosition {
    private final double[] values;

    public JointPosition(int axes) {
        values = new double[axes];
    }

    public JointPosition(double... values) {
        this.values = values.clone();
    }

    public JointPosition(JointPosition other) {
        this(other.values);
    }

    public double get(int axis) {
        return values[axis];
    }

    public double get(JointEnum joint) {
        return values[joint.ordinal()];
    }

    public double[] get() {
        return values.clone();
    }

    public double[] getInternalArray() {
        return values;
    }

    public void set(int axis, double value) {
        values[axis] = value;
    }

    public void set(double... other) {
        if (other.length != values.length) {
            throw new IllegalArgumentException(other.length + " values for " + values.length + " axes");
        }
        System.arraycopy(other, 0, values, 0, values.length);
    }

    public void set(JointPosition other) {
        set(other.values);
    }

    public int getAxisCount() {
        return values.length;
    }

    public boolean isNearlyEqual(JointPosition other, double tolerance) {
        for (int i = 0; i < values.length; i++) {
            if (Math.abs(values[i] - other.values[i]) > tolerance) {
                return false;
            }
        }
        return true;
    }

    @Override
    public String toString() {
        return Arrays.toString(values);
    }
}
