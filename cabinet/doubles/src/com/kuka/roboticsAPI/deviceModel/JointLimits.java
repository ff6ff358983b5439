package com.kuka.roboticsAPI.deviceModel;

/** Position limits of a robot. */
public final class JointLimits {
    private final JointPosition low;
    private final JointPosition high;

    public JointLimits(JointPosition low, JointPosition high) {
        this.low = low;
        this.high = high;
    }

    public JointPosition getMinJointPosition() {
        return new JointPosition(low);
    }

    public JointPosition getMaxJointPosition() {
        return new JointPosition(high);
    }
}
