package heptarm.doubles;

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

/**
 * A servo motion under way. Destinations go into the ring's box, where the plant takes the newest at its next tick;
 * only Cartesian ones ask Python for the joints.
 */
public final class ServoRuntime implements ISmartServoRuntime, IDirectServoRuntime, ISmartServoLINRuntime {
    /** Remaining time when none is known. */
    private static final double UNKNOWN = -999.0;

    private static final double[] FREE = {Double.NaN, -1, -1};

    private final Station station;
    private final LBR robot;
    private final Container container;
    private final ObjectFrame moved;
    private final IMotionControlMode mode;
    private final boolean isStraight;
    private final CountDownLatch activated = new CountDownLatch(1);
    private JointPosition destination;
    private IServoOnGoalReachedEvent handler;
    private int targets;
    private int told;

    public ServoRuntime(Station station, LBR robot, Container container, ObjectFrame moved, IMotionControlMode mode,
            boolean isStraight) {
        this.station = station;
        this.robot = robot;
        this.container = container;
        this.moved = moved;
        this.mode = mode;
        this.isStraight = isStraight;
        this.destination = robot.getCommandedJointPosition();
    }

    /** The motion runs or has ended. */
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
        // the moved frame's target, seen from the base, then the flange's
        Transformation flange = wanted.transformationFromWorld().compose(robot.getFlange().transformationTo(moved).invert());
        double[] near;
        synchronized (this) {
            near = destination.get();
        }
        double[] joints = station.plant.inverse(Orders.pose(flange), FREE, near);
        if (joints == null) {
            throw new CommandInvalidException("Can not plan motion: the destination of the servo motion is not reachable");
        }
        JointPosition reached = new JointPosition(joints);
        return isStraight ? post(reached, Orders.pose(wanted.transformationFromWorld()), null) : post(reached, null);
    }

    @Override
    public long setDestination(Frame wanted, AbstractFrame reference) {
        return setDestination(new Frame(reference, wanted.getTransformationFromParent()));
    }

    private long post(JointPosition wanted, double[] velocity) {
        return post(wanted, wanted.get(), velocity);
    }

    /** What the plant is told: the joints; on straight lines the pose of the moved frame. */
    private long post(JointPosition wanted, double[] told, double[] velocity) {
        if (container.isFinished()) {
            throw new CommandInvalidException("the servo motion has ended; command a new one");
        }
        robot.checkLimits(wanted);
        synchronized (this) {
            destination = new JointPosition(wanted);
            targets++;
        }
        station.ring.post(container.id, told, velocity);
        return System.currentTimeMillis();
    }

    @Override
    public long updateWithRealtimeSystem() {
        IServoOnGoalReachedEvent listening = null;
        int target;
        synchronized (this) {
            target = targets;
            if (handler != null && told < targets && isDestinationReached()) {
                told = targets;
                listening = handler;
            }
        }
        if (listening != null) {
            IServoOnGoalReachedEvent one = listening;
            double[] here = robot.getCurrentJointPosition().get();
            station.dispatch.execute(() -> one.onGoalReachedEvent("GOAL_REACHED", here, new int[] {0, 0}, target));
        }
        return System.currentTimeMillis();
    }

    @Override
    public long getTimeStampOfSetRealtimeDestination() {
        return System.currentTimeMillis();
    }

    @Override
    public boolean stopMotion() {
        container.cancel();
        return true;
    }

    @Override
    public double getRemainingTime() {
        double left = station.ring.number(Ring.REMAINING);
        return Double.isNaN(left) || container.isFinished() ? UNKNOWN : left;
    }

    @Override
    public boolean isDestinationReached() {
        return station.ring.number(Ring.REMAINING) <= 0.0;
    }

    /** Takes other parameters of the same kind of mode. */
    @Override
    public void changeControlModeSettings(IMotionControlMode settings) {
        if (mode == null || mode.getClass() != settings.getClass()) {
            throw new CommandInvalidException("the control mode of a running servo motion cannot become another kind");
        }
        station.plant.changeMode(container.id, Modes.of(settings, moved, robot));
    }

    @Override
    public synchronized void setGoalReachedEventHandler(IServoOnGoalReachedEvent listener) {
        handler = listener;
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
