package com.kuka.device.common;

/** Joint positions [rad]. */
public final class JointPosition {
    private final double[] values;

    public JointPosition(double... values) {
        this.values = values.clone();
    }

    public double[] toArray() {
        return values.clone();
    }
}
