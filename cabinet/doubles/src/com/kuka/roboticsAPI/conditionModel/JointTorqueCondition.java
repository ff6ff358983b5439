package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.deviceModel.JointEnum;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.Criterion;

/** The external torque of a joint lies outside a band [Nm]. */
public class JointTorqueCondition extends Criterion {
    private final JointEnum joint;
    private final double[] band;

    public JointTorqueCondition(JointEnum joint, double low, double high) {
        if (joint.ordinal() > JointEnum.J7.ordinal()) {
            throw new IllegalArgumentException("the robot has 7 joints, not " + joint);
        }
        this.joint = joint;
        this.band = band(low, high);
    }

    public JointTorqueCondition(LBR robot, JointEnum joint, double low, double high) {
        this(joint, low, high);
    }

    /** Number of the joint and the band; for the simulation. */
    public double[] numbers() {
        return new double[] {joint.ordinal(), band[0], band[1]};
    }
}
