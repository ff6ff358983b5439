package com.kuka.roboticsAPI.sensorModel;

import com.kuka.roboticsAPI.deviceModel.JointEnum;

/** Joint torques [Nm]. */
public final class TorqueSensorData {
    private final double[] values;

    public TorqueSensorData(double[] values) {
        this.values = values;
    }

    public double[] getTorqueValues() {
        return values.clone();
    }

    public double getSingleTorqueValue(JointEnum joint) {
        if (joint.ordinal() >= values.length) {
            throw new IllegalArgumentException("the robot has " + values.length + " joints, not " + joint);
        }
        return values[joint.ordinal()];
    }
}
