package heptarm.doubles2;

import java.util.concurrent.TimeUnit;

import com.kuka.device.common.JointPosition;
import com.kuka.geometry.Frame;
import com.kuka.servoing.api.common.EServoRequestState;
import com.kuka.servoing.api.smartservo.ISmartServo;
import com.kuka.servoing.api.smartservo.ISmartServoRuntime;

import heptarm.sunrise1.connectivity.motionModel.smartServo.SmartServo;

/** A SmartServo motion over that of 1.x. */
final class Servo implements ISmartServo, ISmartServoRuntime {
    private final SmartServo behind;

    Servo(JointPosition start) {
        behind = new SmartServo(new heptarm.sunrise1.roboticsAPI.deviceModel.JointPosition(start.toArray()));
    }

    @Override
    public SmartServo behind() {
        return behind;
    }

    @Override
    public ISmartServo setMinimumTrajectoryExecutionTime(double seconds) {
        behind.setMinimumTrajectoryExecutionTime(seconds);
        return this;
    }

    @Override
    public ISmartServo setJointVelocityRel(double value) {
        behind.setJointVelocityRel(value);
        return this;
    }

    @Override
    public ISmartServo setJointAccelerationRel(double value) {
        behind.setJointAccelerationRel(value);
        return this;
    }

    @Override
    public ISmartServoRuntime getRuntime(long time, TimeUnit unit) {
        behind.getRuntime(true);
        return this;
    }

    @Override
    public EServoRequestState setDestination(JointPosition target) {
        return request(() -> behind.getRuntime().setDestination(
                new heptarm.sunrise1.roboticsAPI.deviceModel.JointPosition(target.toArray())));
    }

    @Override
    public EServoRequestState setDestination(Frame target) {
        return request(() -> behind.getRuntime().setDestination(Behind.frame(target)));
    }

    private static EServoRequestState request(Runnable call) {
        try {
            call.run();
            return EServoRequestState.SUCCESSFUL;
        } catch (RuntimeException e) {
            return EServoRequestState.REFUSED;
        }
    }
}
