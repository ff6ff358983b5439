package heptarm.doubles2;

import com.kuka.motion.IMotion;

import heptarm.sunrise1.roboticsAPI.motionModel.RobotMotion;

/** A motion with the setters that public programs for 2.x use. */
public final class Motion implements IMotion {
    private final RobotMotion<?> behind;

    public Motion(RobotMotion<?> behind) {
        this.behind = behind;
    }

    @Override
    public RobotMotion<?> behind() {
        return behind;
    }

    public Motion setJointVelocityRel(double value) {
        behind.setJointVelocityRel(value);
        return this;
    }

    public Motion setJointAccelerationRel(double value) {
        behind.setJointAccelerationRel(value);
        return this;
    }
}
