package com.kuka.roboticsAPI.sensorModel;

import java.util.Arrays;

/** Largest torque of each joint over a time [Nm]. */
public final class TorqueStatistic {
    private final double[] most;

    TorqueStatistic(double[] most) {
        this.most = most.clone();
    }

    public double[] getMaxAbsTorqueValues() {
        return most.clone();
    }

    @Override
    public String toString() {
        return "largest torques " + Arrays.toString(most) + " Nm";
    }
}
