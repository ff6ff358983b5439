package heptarm.doubles2;

import com.kuka.device.common.JointPosition;

/** Joint limits; the name of the class is unknown. */
public final class Limits {
    private final heptarm.sunrise1.roboticsAPI.deviceModel.JointLimits behind;

    public Limits(heptarm.sunrise1.roboticsAPI.deviceModel.JointLimits behind) {
        this.behind = behind;
    }

    public JointPosition getMinJointPosition() {
        return new JointPosition(behind.getMinJointPosition().get());
    }

    public JointPosition getMaxJointPosition() {
        return new JointPosition(behind.getMaxJointPosition().get());
    }
}
