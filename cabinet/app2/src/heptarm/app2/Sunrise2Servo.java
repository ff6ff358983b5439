package heptarm.app2;

import java.lang.reflect.InvocationTargetException;
import java.lang.reflect.Method;
import java.util.concurrent.TimeUnit;

import com.kuka.device.common.JointPosition;
import com.kuka.geometry.Frame;
import com.kuka.geometry.LocalFrame;
import com.kuka.motion.IMotionContainer;
import com.kuka.sensitivity.LBR;
import com.kuka.servoing.api.common.IServoingCapability;
import com.kuka.servoing.api.smartservo.ISmartServo;
import com.kuka.servoing.api.smartservo.ISmartServoRuntime;

import heptarm.core.CommandRejected;
import heptarm.core.robot.FailureTexts;
import heptarm.core.robot.ServoJob;
import heptarm.wire.Code;
import heptarm.wire.Mode;
import heptarm.wire.Pose;
import heptarm.wire.PositionMode;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;

/** A SmartServo motion of Sunrise 2.x. Some versions report a refused target by a value, others by an exception. */
final class Sunrise2Servo implements ServoJob {
    private static final String SUCCESSFUL = "SUCCESSFUL";
    private static final long ACTIVATION_MS = 500;

    private final LBR lbr;
    private final Sunrise2Job job;
    private final ISmartServo motion;
    private ISmartServoRuntime runtime;

    Sunrise2Servo(ServoOpen open, LBR lbr, IServoingCapability servoing, Sunrise2Job job) {
        this.lbr = lbr;
        this.job = job;
        motion = servoing.createSmartServoMotion(lbr.getCurrentJointPosition());
        motion.setMinimumTrajectoryExecutionTime(open.timing.min_trajectory_time);
        motion.setJointVelocityRel(open.velocity);
        motion.setJointAccelerationRel(open.acceleration);
    }

    /** Refuses a servo motion that this preview cannot express. */
    static void check(ServoOpen open) throws CommandRejected {
        if (open.engine != ServoEngine.SMART) {
            throw Sunrise2Robot.unsupported("engine", "the servo engine " + open.engine);
        }
        if (open.mode != null && !(open.mode instanceof PositionMode)) {
            throw Sunrise2Robot.unsupported("mode", "servo motions under impedance control");
        }
    }

    /** Start the motion. */
    IMotionContainer start() {
        return lbr.getFlange().moveAsync(motion);
    }

    @Override
    public void cancel() {
        job.cancel();
    }

    @Override
    public void follow(double[] q, double[] velocity) throws CommandRejected {
        if (velocity != null) {
            throw Sunrise2Robot.unsupported("dq", "servo targets with a velocity");
        }
        set(JointPosition.class, new JointPosition(q));
    }

    @Override
    public void followPose(double[] xyz, double[] quat) throws CommandRejected {
        set(Frame.class, new LocalFrame(lbr.getRootFrame(), Sunrise2Sensors.transformation(new Pose(xyz, quat))));
    }

    @Override
    public void changeMode(Mode mode) throws CommandRejected {
        throw Sunrise2Robot.unsupported("mode", "servo motions under impedance control");
    }

    private void set(Class<?> type, Object target) throws CommandRejected {
        String refused;
        try {
            if (runtime == null) {
                runtime = motion.getRuntime(ACTIVATION_MS, TimeUnit.MILLISECONDS);
            }
            Method method = ISmartServoRuntime.class.getMethod("setDestination", type);
            Object result = method.invoke(runtime, target);
            if (result == null || SUCCESSFUL.equals(String.valueOf(result))) {
                return;
            }
            refused = "the cabinet reports " + result;
        } catch (InvocationTargetException e) {
            refused = String.valueOf(e.getCause().getMessage());
        } catch (ReflectiveOperationException e) {
            throw Sunrise2Robot.unsupported("", "servo targets of this kind");
        } catch (RuntimeException e) {
            refused = String.valueOf(e.getMessage());
        }
        int code = FailureTexts.code(refused);
        throw new CommandRejected(code == 0 ? Code.EXECUTION_FAILED : code, refused);
    }
}
