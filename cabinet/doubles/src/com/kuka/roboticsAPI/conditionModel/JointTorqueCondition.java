package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.deviceModel.JointEnum;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.motion.AbstractCondition;
import heptarm.doubles.seam.Condition;
import heptarm.doubles.seam.JointTorqueOutside;

/** The external torque of a joint is outside a band [Nm]. */
public class JointTorqueCondition extends AbstractCondition {
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

    @Override
    protected Condition forPlant(LBR robot) {
        JointTorqueOutside outside = new JointTorqueOutside();
        outside.joint = joint.ordinal();
        outside.low = band[0];
        outside.high = band[1];
        return outside;
    }
}
