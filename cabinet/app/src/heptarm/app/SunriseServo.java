package heptarm.app;

import com.kuka.connectivity.motionModel.directServo.DirectServo;
import com.kuka.connectivity.motionModel.directServo.IDirectServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.IServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.ISmartServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

import heptarm.core.Refusal;
import heptarm.core.Servo;
import heptarm.wire.Code;
import heptarm.wire.Mode;
import heptarm.wire.Pose;
import heptarm.wire.PositionMode;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;

/** A servo motion of Sunrise. Only this class names the option's classes, so that a cabinet without it still runs. */
final class SunriseServo implements Servo {
    private final LBR robot;
    private final Tools tools;
    private final ObjectFrame moved;
    private final SunriseJob job;
    private final ServoMotion<?> motion;
    private final boolean isStraight;
    private boolean passes;

    private SunriseServo(LBR robot, Tools tools, ObjectFrame moved, SunriseJob job, ServoMotion<?> motion, boolean isStraight) {
        this.robot = robot;
        this.tools = tools;
        this.moved = moved;
        this.job = job;
        this.motion = motion;
        this.isStraight = isStraight;
    }

    /** A servo motion at the present position. */
    static SunriseServo of(ServoOpen open, LBR robot, Tools tools, SunriseJob job) throws Refusal {
        ServoMotion<?> motion = open.engine == ServoEngine.LIN ? SunriseLin.of(open, robot, tools) : joints(open, robot);
        motion.setMinimumTrajectoryExecutionTime(open.min_trajectory_time);
        motion.setTimeoutAfterGoalReach(open.goal_timeout);
        if (open.engine == ServoEngine.SMART) {
            motion.setSpeedTimeoutAfterGoalReach(open.speed_timeout);
        }
        if (open.mode != null && !(open.mode instanceof PositionMode)) {
            if (!ServoMotion.validateForImpedanceMode(tools.carrier())) {
                throw new Refusal(Code.NOT_READY, "impedance control cannot begin: the arm has to rest, away from a singularity,"
                        + " with nothing pushing it and the load data right (less than 10 Nm external torque in every joint)");
            }
            motion.setMode(new Modes(tools).of(open.mode));
        }
        return new SunriseServo(robot, tools, tools.moved(open.frame), job, motion, open.engine == ServoEngine.LIN);
    }

    private static ServoMotion<?> joints(ServoOpen open, LBR robot) {
        JointPosition here = robot.getCurrentJointPosition();
        ServoMotion<?> motion = open.engine == ServoEngine.DIRECT ? new DirectServo(here) : new SmartServo(here);
        motion.setJointVelocityRel(open.velocity);
        motion.setJointAccelerationRel(open.acceleration);
        return motion;
    }

    /** Begins it. */
    IMotionContainer start() {
        return moved.moveAsync(motion, job);
    }

    public void cancel() {
        job.cancel();
    }

    public void follow(double[] q, double[] velocity) throws Refusal {
        try {
            IServoRuntime runtime = motion.getRuntime();
            if (motion instanceof DirectServo) {
                ((IDirectServoRuntime) runtime).setDestination(new JointPosition(q));
            } else if (velocity == null) {
                ((ISmartServoRuntime) runtime).setDestination(new JointPosition(q));
            } else {
                ISmartServoRuntime smart = (ISmartServoRuntime) runtime;
                if (!passes) { // once, with the first target that has a velocity
                    smart.activateVelocityPlanning(true);
                    passes = true;
                }
                smart.setDestination(new JointPosition(q), new JointPosition(velocity));
            }
        } catch (RuntimeException e) {
            throw refusal(e);
        }
    }

    public void followPose(double[] xyz, double[] quat) throws Refusal {
        try {
            Frame target = new Frame(robot.getRootFrame(), Convert.transformation(new Pose(xyz, quat)));
            if (isStraight) {
                SunriseLin.follow(motion, target);
            } else if (motion instanceof DirectServo) {
                ((IDirectServoRuntime) motion.getRuntime()).setDestination(target);
            } else {
                ((ISmartServoRuntime) motion.getRuntime()).setDestination(target);
            }
        } catch (RuntimeException e) {
            throw refusal(e);
        }
    }

    public void change(Mode mode) throws Refusal {
        Modes modes = new Modes(tools);
        modes.check(mode, moved, "mode.");
        try {
            motion.getRuntime().changeControlModeSettings(modes.of(mode));
        } catch (RuntimeException e) {
            throw refusal(e);
        }
    }

    private static Refusal refusal(RuntimeException error) {
        String text = String.valueOf(error.getMessage());
        return new Refusal(SunriseJob.code(text), text);
    }
}
