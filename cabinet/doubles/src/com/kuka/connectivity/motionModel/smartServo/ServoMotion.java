package com.kuka.connectivity.motionModel.smartServo;

import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

import heptarm.doubles.motion.ServoRuntime;
import heptarm.doubles.seam.ServoTiming;

/** A motion that follows destinations given while it runs; {@code T} is its own type, so that setters chain. */
public abstract class ServoMotion<T extends ServoMotion<T>> extends RobotMotion<T> {
    private static final double GOAL_TIMEOUT = 30.0;

    private final ServoTiming timing = new ServoTiming();
    private ServoRuntime runtime;

    protected ServoMotion() {
        timing.goalTimeout = GOAL_TIMEOUT;
    }

    /** Whether a servo motion in impedance control may start now: at rest, without contact, not singular, with correct load data. */
    public static boolean validateForImpedanceMode(PhysicalObject object) {
        LBR robot = object.carrier();
        if (robot == null) {
            throw new IllegalArgumentException(object.getName() + " is not attached to a robot");
        }
        return robot.isFitForImpedance();
    }

    public T setMinimumTrajectoryExecutionTime(double seconds) {
        timing.minTrajectoryTime = positive("minimumTrajectoryExecutionTime", seconds);
        return self();
    }

    public T setTimeoutAfterGoalReach(double seconds) {
        timing.goalTimeout = positive("timeoutAfterGoalReach", seconds);
        return self();
    }

    public T setTimeoutAfterGoalReach(long time, TimeUnit unit) {
        return setTimeoutAfterGoalReach(unit.toNanos(time) * 1e-9);
    }

    public T setSpeedTimeoutAfterGoalReach(double seconds) {
        timing.speedTimeout = positive("speedTimeoutAfterGoalReach", seconds);
        return self();
    }

    /** Has no effect: the simulation does not exceed the robot's own acceleration. */
    public T overrideJointAcceleration(double factor) {
        positive("factor", factor);
        return self();
    }

    /** Has no effect: the trace is a file for KUKA's service. */
    public T useTrace(boolean on) {
        return self();
    }

    /** The running motion; waits until it has started. */
    public IServoRuntime getRuntime() {
        return getRuntime(true);
    }

    /** The running motion; with {@code waitForActivation} waits until it has started. */
    public IServoRuntime getRuntime(boolean waitForActivation) {
        return running(waitForActivation);
    }

    /** The same for the simulation. */
    protected final ServoRuntime running(boolean waitForActivation) {
        ServoRuntime accepted;
        synchronized (this) {
            accepted = runtime;
        }
        if (accepted == null) {
            throw new IllegalStateException("the servo motion is not commanded: call moveAsync first");
        }
        if (waitForActivation) {
            accepted.awaitActivation();
        }
        return accepted;
    }

    /** For the simulation. */
    protected final ServoTiming timing() {
        return timing;
    }

    /** The cabinet has accepted the motion; for the simulation. */
    public synchronized void accepted(ServoRuntime accepted) {
        runtime = accepted;
    }
}
