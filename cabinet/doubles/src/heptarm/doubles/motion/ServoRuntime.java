package heptarm.doubles.motion;

import java.util.concurrent.CountDownLatch;

import com.kuka.connectivity.motionModel.directServo.IDirectServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.IServoOnGoalReachedEvent;
import com.kuka.connectivity.motionModel.smartServo.ISmartServoRuntime;
import com.kuka.connectivity.motionModel.smartServoLIN.ISmartServoLINRuntime;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

import heptarm.doubles.plant.PeriodicSampler;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.Seam;
import heptarm.doubles.seam.StateWords;

/**
 * Runtime of a running servo motion. Destinations go into the servo target of the shared memory, from which the plant takes
 * the newest at its next tick; only Cartesian destinations call Python, for the inverse kinematics.
 */
public final class ServoRuntime implements ISmartServoRuntime, IDirectServoRuntime, ISmartServoLINRuntime {
    /** Remaining time while none is available. */
    private static final double UNKNOWN = -999.0;
    /** Period of looking for reached goals. */
    private static final long WATCH_NS = 5 * Seam.TICK_NS;
    /** After so many ticks the state is that of the newest destination. */
    private static final long TAKEN = 3;

    private final Station station;
    private final LBR robot;
    private final MotionContainer container;
    private final ObjectFrame moved;
    private final IMotionControlMode mode;
    private final boolean isStraight;
    private final CountDownLatch activated = new CountDownLatch(1);
    private JointPosition destination;
    private IServoOnGoalReachedEvent handler;
    private int targets;
    private int reported;
    private long seenFrom;
    private PeriodicSampler watching;

    public ServoRuntime(Station station, LBR robot, MotionContainer container, ObjectFrame moved, IMotionControlMode mode,
            boolean isStraight) {
        this.station = station;
        this.robot = robot;
        this.container = container;
        this.moved = moved;
        this.mode = mode;
        this.isStraight = isStraight;
        this.destination = robot.getCommandedJointPosition();
    }

    /** Releases waiting threads: the motion runs or has ended. */
    void activate() {
        activated.countDown();
    }

    public void awaitActivation() {
        try {
            activated.await();
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new IllegalStateException("interrupted while waiting for a servo motion", e);
        }
    }

    @Override
    public long setDestination(JointPosition wanted) {
        return post(wanted, null);
    }

    @Override
    public long setDestination(JointPosition wanted, JointPosition velocity) {
        return post(wanted, velocity.get());
    }

    @Override
    public long setDestination(AbstractFrame wanted) {
        // target of the motion frame in the base, then of the flange
        Transformation flange = wanted.transformationFromWorld().compose(robot.getFlange().transformationTo(moved).invert());
        double[] near;
        synchronized (this) {
            near = destination.get();
        }
        double[] joints = station.plant.inverse(MotionTranslator.pose(flange), Double.NaN, -1, near);
        if (joints == null) {
            throw new IllegalStateException("Can not plan motion: the destination of the servo motion is not reachable");
        }
        JointPosition reached = new JointPosition(joints);
        return isStraight ? post(reached, MotionTranslator.pose(wanted.transformationFromWorld()), null) : post(reached, null);
    }

    @Override
    public long setDestination(Frame wanted, AbstractFrame reference) {
        return setDestination(new Frame(reference, wanted.getTransformationFromParent()));
    }

    private long post(JointPosition wanted, double[] velocity) {
        return post(wanted, wanted.get(), velocity);
    }

    /** Sends the joints or, for straight lines, the pose of the motion frame. */
    private long post(JointPosition wanted, double[] target, double[] velocity) {
        if (container.isFinished()) {
            throw new CommandInvalidException("cannot set a destination: the servo motion has ended; command a new one");
        }
        try {
            robot.checkLimits(wanted);
        } catch (CommandInvalidException e) { // a running servo motion refuses a destination by another exception than a command
            throw new IllegalStateException("the destination of the servo motion is invalid: " + e.getMessage(), e);
        }
        synchronized (this) {
            destination = new JointPosition(wanted);
            targets++;
            seenFrom = station.sharedState.newest() + TAKEN;
        }
        station.sharedState.postTarget(container.id, target, velocity);
        return station.stamp();
    }

    @Override
    public long updateWithRealtimeSystem() {
        reportGoal();
        return station.stamp();
    }

    private void reportGoal() {
        double[] state = new double[StateWords.REMAINING + 1]; // in one piece: the time that is left belongs to its tick
        station.sharedState.read(0, state);
        long tick = Double.doubleToRawLongBits(state[StateWords.SEQ]) / 2 - 1;
        boolean isReached = state[StateWords.REMAINING] <= 0.0;
        IServoOnGoalReachedEvent notified;
        int target;
        synchronized (this) {
            if (handler == null || reported == targets || tick < seenFrom || container.isFinished() || !isReached) {
                return;
            }
            reported = targets;
            notified = handler;
            target = targets;
        }
        double[] position = robot.getCurrentJointPosition().get();
        container.dispatch(() -> notified.onGoalReachedEvent("GOAL_REACHED", position, new int[] {0, 0}, target));
    }

    /** Looks for reached goals while the motion runs: an application need not update the runtime to receive them. */
    private void watch(long nanos) {
        if (container.isFinished()) {
            watching.stop();
        } else {
            reportGoal();
        }
    }

    @Override
    public long getTimeStampOfSetRealtimeDestination() {
        return station.stamp();
    }

    @Override
    public boolean stopMotion() {
        container.cancel();
        return true;
    }

    @Override
    public double getRemainingTime() {
        double left = station.sharedState.number(StateWords.REMAINING);
        return Double.isNaN(left) || container.isFinished() ? UNKNOWN : left;
    }

    @Override
    public boolean isDestinationReached() {
        return station.sharedState.number(StateWords.REMAINING) <= 0.0;
    }

    /** Changes the parameters of the control mode; its kind stays. */
    @Override
    public void changeControlModeSettings(IMotionControlMode settings) {
        if (mode == null || mode.getClass() != settings.getClass()) {
            throw new CommandInvalidException("cannot change the kind of control mode of a running servo motion; command a new motion");
        }
        station.plant.changeMode(container.id, ControlModeTranslator.of(settings, moved, robot));
    }

    @Override
    public synchronized void setGoalReachedEventHandler(IServoOnGoalReachedEvent listener) {
        handler = listener;
        if (watching == null) {
            watching = new PeriodicSampler(WATCH_NS, this::watch);
            watching.start();
        }
    }

    @Override
    public void activateVelocityPlanning(boolean active) {
    }

    @Override
    public synchronized JointPosition getCurrentJointDestination() {
        return new JointPosition(destination);
    }

    @Override
    public Frame getCurrentCartesianDestination(ObjectFrame frame) {
        return robot.cartesian(getCurrentJointDestination(), frame);
    }

    @Override
    public Frame getCurrentCartesianPosition(ObjectFrame frame) {
        return robot.getCurrentCartesianPosition(frame);
    }

    @Override
    public JointPosition getAxisQMsrOnController() {
        return robot.getCurrentJointPosition();
    }

    @Override
    public double[] getAxisTauExtMsr() {
        return robot.getExternalTorque().getTorqueValues();
    }

    @Override
    public String getFineIpoState() {
        return container.getState().toString();
    }

    @Override
    public String toString() {
        return "servo motion " + container.id + ", " + targets + " destinations, " + container.getState();
    }
}
