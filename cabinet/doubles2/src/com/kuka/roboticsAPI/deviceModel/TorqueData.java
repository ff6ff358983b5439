package com.kuka.roboticsAPI.deviceModel;

/** Torques of the joints [Nm]. */
public final class TorqueData {
    private final double[] values;

    public TorqueData(double[] values) {
        this.values = values;
    }

    public double[] getTorqueValues() {
        return values;
    }
}
