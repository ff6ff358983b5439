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

import heptarm.core.CommandRejected;
import heptarm.core.robot.FailureTexts;
import heptarm.core.robot.ServoJob;
import heptarm.wire.Code;
import heptarm.wire.Mode;
import heptarm.wire.Pose;
import heptarm.wire.PositionMode;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;

/** A servo motion of Sunrise. Only this class refers to the option's classes, so a cabinet without it still works. */
final class SunriseServo implements ServoJob {
    private final LBR robot;
    private final ControlModes modes;
    private final ObjectFrame moved;
    private final SunriseJob job;
    private final ServoMotion<?> motion;
    private final boolean isStraight;
    private boolean hasVelocities;

    private SunriseServo(LBR robot, ControlModes modes, ObjectFrame moved, SunriseJob job, ServoMotion<?> motion, boolean isStraight) {
        this.robot = robot;
        this.modes = modes;
        this.moved = moved;
        this.job = job;
        this.motion = motion;
        this.isStraight = isStraight;
    }

    /** Capabilities that the option adds; a LinkageError if it is not installed. */
    static String[] capabilities() {
        return SmartServo.class == null ? new String[0] : new String[] {"servo", "servo_direct", "servo_pose"};
    }

    /** Build a servo motion at the current position. */
    static SunriseServo of(ServoOpen open, LBR robot, SunriseTools tools, ControlModes modes, SunriseJob job) throws CommandRejected {
        ServoMotion<?> motion = open.engine == ServoEngine.LIN ? SunriseServoLin.of(open, robot, tools) : joints(open, robot);
        motion.setMinimumTrajectoryExecutionTime(open.timing.min_trajectory_time);
        motion.setTimeoutAfterGoalReach(open.timing.goal_timeout);
        if (open.engine == ServoEngine.SMART) {
            motion.setSpeedTimeoutAfterGoalReach(open.timing.speed_timeout);
        }
        if (open.mode != null && !(open.mode instanceof PositionMode)) {
            if (!ServoMotion.validateForImpedanceMode(tools.carrier())) {
                throw new CommandRejected(Code.NOT_READY, "impedance control cannot start; the arm must rest away from a singularity"
                        + " with less than 10 Nm external torque in every joint: check contacts and load data");
            }
            motion.setMode(modes.of(open.mode));
        }
        return new SunriseServo(robot, modes, tools.motionFrame(open.frame), job, motion, open.engine == ServoEngine.LIN);
    }

    private static ServoMotion<?> joints(ServoOpen open, LBR robot) {
        JointPosition here = robot.getCurrentJointPosition();
        ServoMotion<?> motion = open.engine == ServoEngine.DIRECT ? new DirectServo(here) : new SmartServo(here);
        motion.setJointVelocityRel(open.velocity);
        motion.setJointAccelerationRel(open.acceleration);
        return motion;
    }

    /** Start the motion. */
    IMotionContainer start() {
        return moved.moveAsync(motion, job);
    }

    public void cancel() {
        job.cancel();
    }

    public void follow(double[] q, double[] velocity) throws CommandRejected {
        try {
            IServoRuntime runtime = motion.getRuntime();
            if (motion instanceof DirectServo) {
                ((IDirectServoRuntime) runtime).setDestination(new JointPosition(q));
            } else if (velocity == null) {
                ((ISmartServoRuntime) runtime).setDestination(new JointPosition(q));
            } else {
                ISmartServoRuntime smart = (ISmartServoRuntime) runtime;
                if (!hasVelocities) { // once, with the first target that has a velocity
                    smart.activateVelocityPlanning(true);
                    hasVelocities = true;
                }
                smart.setDestination(new JointPosition(q), new JointPosition(velocity));
            }
        } catch (RuntimeException e) {
            throw refusal(e);
        }
    }

    public void followPose(double[] xyz, double[] quat) throws CommandRejected {
        try {
            Frame target = new Frame(robot.getRootFrame(), Convert.transformation(new Pose(xyz, quat)));
            if (isStraight) {
                SunriseServoLin.follow(motion, target);
            } else if (motion instanceof DirectServo) {
                ((IDirectServoRuntime) motion.getRuntime()).setDestination(target);
            } else {
                ((ISmartServoRuntime) motion.getRuntime()).setDestination(target);
            }
        } catch (RuntimeException e) {
            throw refusal(e);
        }
    }

    public void changeMode(Mode mode) throws CommandRejected {
        modes.check(mode, moved, "mode.");
        try {
            motion.getRuntime().changeControlModeSettings(modes.of(mode));
        } catch (RuntimeException e) {
            throw refusal(e);
        }
    }

    private static CommandRejected refusal(RuntimeException error) {
        String text = String.valueOf(error.getMessage());
        return new CommandRejected(FailureTexts.code(text), text);
    }
}
