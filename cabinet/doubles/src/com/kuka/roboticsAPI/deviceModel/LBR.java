package com.kuka.roboticsAPI.deviceModel;

import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import java.util.concurrent.atomic.AtomicLong;
import java.util.regex.Pattern;

import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.connectivity.motionModel.smartServoLIN.SmartServoLIN;
import com.kuka.connectivity.motionModel.directServo.DirectServo;
import com.kuka.roboticsAPI.RoboticsAPIContext;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISafetyState;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.SceneGraphObject;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.geometricModel.math.Vector;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;
import com.kuka.roboticsAPI.sensorModel.ForceSensorData;
import com.kuka.roboticsAPI.sensorModel.SensorForExternalForce;
import com.kuka.roboticsAPI.sensorModel.SensorForExternalTorque;
import com.kuka.roboticsAPI.sensorModel.SensorForMeasuredTorque;
import com.kuka.roboticsAPI.sensorModel.TorqueSensorData;

import heptarm.doubles.motion.AppendedMotion;
import heptarm.doubles.motion.ForwardKinematics;
import heptarm.doubles.motion.MotionContainer;
import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.motion.Poses;
import heptarm.doubles.motion.AttachedLoadCalculator;
import heptarm.doubles.motion.ServoRuntime;
import heptarm.doubles.motion.WrenchUncertainty;
import heptarm.doubles.runtime.ApplicationServices;
import heptarm.doubles.runtime.SafetyEvents;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.EndCause;
import heptarm.doubles.seam.MotionOrder;
import heptarm.doubles.seam.Redundancy;
import heptarm.doubles.seam.SafetyFlags;
import heptarm.doubles.seam.StateWords;

/** The robot. Motions of the robot itself move its flange. */
public abstract class LBR extends Robot {
    private static final int AXES = 7;
    /** Rounding [rad]. */
    private static final double ON_LIMIT = 1e-9;
    /** Of the checks before impedance control: [Nm], [rad/s], elbow's angle [rad]. */
    private static final double LARGEST_EXTERNAL = 10.0;
    private static final double AT_REST = 0.01;
    private static final double SINGULAR = 0.02;
    private static final int STOPS = SafetyFlags.EMERGENCY_STOP | SafetyFlags.EXTERNAL_STOP | SafetyFlags.SAFEGUARD_OPEN
            | SafetyFlags.PROTECTIVE_STOP | SafetyFlags.DRIVE_ERROR;

    private static final Pattern ESM_STATE = Pattern.compile("[1-9]|10");

    private final Station station;
    private final ForwardKinematics kinematics;
    private final ObjectFrame root;
    private final ObjectFrame flange;
    private final Object safetyLock = new Object();
    private Workpiece safetyWorkpiece;
    private Transformation safetyPlace = Transformation.IDENTITY; // in the flange frame
    private volatile Object home = new JointPosition(AXES);
    private final AtomicLong ids = new AtomicLong();
    private final Map<MotionContainer, Boolean> open = new LinkedHashMap<>(); // value: asynchronous

    protected LBR(String name, Controller controller, Station station) {
        super(name, controller);
        this.station = station;
        kinematics = new ForwardKinematics(station.description);
        root = getRootFrame();
        flange = new ObjectFrame("Flange", this, () -> root, () -> Poses.ofQuaternion(numbers(StateWords.POSE, 7)));
    }

    private double[] numbers(int word, int count) {
        double[] out = new double[count];
        station.sharedState.read(word, out);
        return out;
    }

    private boolean flag(int bit) {
        return station.sharedState.flag(bit);
    }

    public ObjectFrame getFlange() {
        return flange;
    }

    /** Motions of the robot itself move its flange. */
    @Override
    public ObjectFrame getDefaultMotionFrame() {
        return flange;
    }

    /** Has no effect: the robot is at the origin of the world. */
    @Override
    public void attachTo(AbstractFrame frame) {
    }

    /**
     * Selects the workpiece whose load the safety functions count beside that of the tools; null: none. It counts where it is attached
     * to the robot, after it was detached where it was; before that at the motion frame of the first tool, or at the flange.
     *
     * @throws IllegalArgumentException it is heavier than the safety configuration allows; the one before stays selected
     */
    public void setSafetyWorkpiece(Workpiece workpiece) {
        synchronized (safetyLock) {
            if (workpiece == null && safetyWorkpiece == null) {
                return;
            }
            Transformation at = workpiece == null ? Transformation.IDENTITY : held(workpiece, holding());
            setSafetyLoad(workpiece, at);
            safetyWorkpiece = workpiece;
            safetyPlace = at;
        }
        station.settle();
    }

    /** Where a workpiece is attached, in the flange frame; elsewhere if it is not attached to this robot. */
    private Transformation held(Workpiece workpiece, Transformation elsewhere) {
        return workpiece.carrier() == this ? flange.transformationTo(workpiece.getRootFrame()) : elsewhere;
    }

    /** The frame at which tools hold workpieces, in the flange frame. */
    private Transformation holding() {
        for (SceneGraphObject one : getChildren()) {
            if (one instanceof Tool) {
                return flange.transformationTo(((Tool) one).getDefaultMotionFrame());
            }
        }
        return Transformation.IDENTITY;
    }

    private void setSafetyLoad(Workpiece workpiece, Transformation at) {
        double mass = workpiece == null ? 0.0 : workpiece.getLoadData().getMass();
        station.plant.setSafetyLoad(AttachedLoadCalculator.ofSafety(flange, getChildren(), workpiece, at), mass);
    }

    /** Home position of ptpHome; default: all zeros. */
    public void setHomePosition(JointPosition joints) {
        checkLimits(joints);
        home = new JointPosition(joints);
    }

    /** Home position of ptpHome, as a pose of the flange. */
    public void setHomePosition(AbstractFrame frame) {
        home = frame;
    }

    /** A JointPosition or an AbstractFrame; for the simulation. */
    public Object home() {
        return home;
    }

    /** Transfers the load to the controller after something was attached or detached; for the simulation. */
    public void carries() {
        station.plant.setAttachedLoad(AttachedLoadCalculator.of(flange, getChildren()));
        synchronized (safetyLock) {
            if (safetyWorkpiece != null) {
                safetyPlace = held(safetyWorkpiece, safetyPlace);
            }
            setSafetyLoad(safetyWorkpiece, safetyPlace);
        }
        station.settle();
    }

    /** Selects one of the safety states "1" to "10" of the project; the simulation monitors none of them. */
    public void setESMState(String state) {
        if (!ESM_STATE.matcher(state).matches()) {
            throw new IllegalArgumentException("safety state must be 1 to 10, got " + state);
        }
        ApplicationServices.current().logger.info("ESM state " + state);
    }

    /**
     * Joint positions for a frame of the flange and its redundancy; what is not given stays as close as possible to the current one.
     *
     * @throws IllegalArgumentException there are none
     */
    public JointPosition getInverseKinematicFromFrameAndRedundancy(Frame frame) {
        Redundancy redundancy = MotionTranslator.redundancy(frame, this);
        double[] found = station.plant.inverse(MotionTranslator.pose(frame.transformationFromWorld()), redundancy.e1,
                redundancy.status, numbers(StateWords.Q_CMD, AXES));
        if (found == null) {
            throw new IllegalArgumentException("no joint positions bring the flange to " + frame.toStringInWorld());
        }
        return new JointPosition(found);
    }

    /** Pose of the flange at given joint positions, in the root frame of the robot. */
    public Frame getForwardKinematic(JointPosition joints) {
        return cartesian(joints, flange);
    }

    /** Where a frame on the robot is now. */
    public PositionInformation getPositionInformation(ObjectFrame frameOnRobot) {
        return new PositionInformation(getCurrentCartesianPosition(frameOnRobot), getCommandedCartesianPosition(frameOnRobot));
    }

    public RoboticsAPIContext getContext() {
        return station.context;
    }

    /** Whether the drives are on and no stop is requested; a pause does not matter. */
    public boolean isMotionEnabled() {
        return flag(SafetyFlags.READY);
    }

    public int getJointCount() {
        return AXES;
    }

    public JointLimits getJointLimits() {
        return new JointLimits(new JointPosition(station.description.qMin), new JointPosition(station.description.qMax));
    }

    public JointPosition getCurrentJointPosition() {
        return new JointPosition(numbers(StateWords.Q, AXES));
    }

    public JointPosition getCommandedJointPosition() {
        return new JointPosition(numbers(StateWords.Q_CMD, AXES));
    }

    public SensorForMeasuredTorque getSensorForMeasuredTorque() {
        return this::getMeasuredTorque;
    }

    public SensorForExternalTorque getSensorForExternalTorque() {
        return this::getExternalTorque;
    }

    public SensorForExternalForce getSensorForExternalForce() {
        return () -> getExternalForceTorque(flange);
    }

    public TorqueSensorData getMeasuredTorque() {
        return new TorqueSensorData(numbers(StateWords.TAU, AXES));
    }

    public TorqueSensorData getExternalTorque() {
        return new TorqueSensorData(numbers(StateWords.TAU_EXT, AXES));
    }

    /** Pose of a frame on the robot in the world, with the redundancy of the arm. */
    public Frame getCurrentCartesianPosition(AbstractFrame frameOnRobot) {
        return withRedundancy(new Frame(frameOnRobot.transformationFromWorld()));
    }

    private Frame withRedundancy(Frame frame) {
        frame.setRedundancyInformation(this, new LBRE1Redundancy(station.sharedState.number(StateWords.E1),
                (int) station.sharedState.integer(StateWords.STATUS), (int) station.sharedState.integer(StateWords.TURN)));
        return frame;
    }

    public Frame getCurrentCartesianPosition(ObjectFrame frameOnRobot, AbstractFrame reference) {
        return withRedundancy(new Frame(reference, reference.transformationTo(frameOnRobot)));
    }

    public Frame getCommandedCartesianPosition(ObjectFrame frameOnRobot) {
        return cartesian(getCommandedJointPosition(), frameOnRobot);
    }

    /** Pose of a frame on the robot at given joint positions; for the simulation. */
    public Frame cartesian(JointPosition joints, ObjectFrame frameOnRobot) {
        Transformation commanded = kinematics.flange(joints.get());
        return new Frame(frameOnRobot == flange ? commanded : commanded.compose(flange.transformationTo(frameOnRobot)));
    }

    public Frame getCommandedCartesianPosition(ObjectFrame frameOnRobot, AbstractFrame reference) {
        Frame commanded = getCommandedCartesianPosition(frameOnRobot);
        return new Frame(reference, reference.transformationFromWorld().invert().compose(commanded.transformationFromWorld()));
    }

    public ForceSensorData getExternalForceTorque(AbstractFrame measureFrame) {
        return getExternalForceTorque(measureFrame, null);
    }

    /** External wrench at the origin of a frame, in the axes of another frame (null: of the same). */
    public ForceSensorData getExternalForceTorque(AbstractFrame measureFrame, AbstractFrame orientationFrame) {
        double[] wrench = numbers(StateWords.WRENCH, 6);
        Transformation here = flange.transformationFromWorld();
        Transformation at = here.compose(flange.transformationTo(measureFrame));
        double[] lever = {(here.getX() - at.getX()) * 1e-3, (here.getY() - at.getY()) * 1e-3, (here.getZ() - at.getZ()) * 1e-3};
        double[] torque = {wrench[3] + lever[1] * wrench[2] - lever[2] * wrench[1],
            wrench[4] + lever[2] * wrench[0] - lever[0] * wrench[2], wrench[5] + lever[0] * wrench[1] - lever[1] * wrench[0]};
        Matrix axes = (orientationFrame == null ? at : orientationFrame.transformationFromWorld()).getRotationMatrix();
        double[] off = WrenchUncertainty.inaccuracy(kinematics, numbers(StateWords.Q, AXES), at, axes);
        return new ForceSensorData(seenFrom(axes, wrench[0], wrench[1], wrench[2]),
                seenFrom(axes, torque[0], torque[1], torque[2]), Vector.of(off[0], off[1], off[2]), Vector.of(off[3], off[4], off[5]));
    }

    private static Vector seenFrom(Matrix axes, double x, double y, double z) {
        return Vector.of(axes.get(0, 0) * x + axes.get(1, 0) * y + axes.get(2, 0) * z,
                axes.get(0, 1) * x + axes.get(1, 1) * y + axes.get(2, 1) * z,
                axes.get(0, 2) * x + axes.get(1, 2) * y + axes.get(2, 2) * z);
    }

    public boolean isReadyToMove() {
        return flag(SafetyFlags.READY) && !flag(SafetyFlags.PAUSED);
    }

    public boolean hasActiveMotionCommand() {
        return flag(SafetyFlags.MOVING);
    }

    public boolean isMastered() {
        return flag(SafetyFlags.MASTERED);
    }

    public OperationMode getOperationMode() {
        return SafetyEvents.operationMode(station.sharedState.integer(StateWords.MODE));
    }

    public ISafetyState getSafetyState() {
        return new SunriseSafetyState(station.sharedState.integer(StateWords.FLAGS), getOperationMode());
    }

    /** Refuses joint positions beyond the limits, with Sunrise's text; for the simulation. */
    public void checkLimits(JointPosition joints) {
        double[] low = station.description.qMin;
        double[] high = station.description.qMax;
        for (int i = 0; i < AXES; i++) {
            double value = joints.get(i);
            if (!(value >= low[i] - ON_LIMIT && value <= high[i] + ON_LIMIT)) {
                throw new CommandInvalidException("Command Position violates limit A" + (i + 1) + ": " + value + " rad");
            }
        }
    }

    /** Whether impedance control may start: at rest, without contact, not stretched out; for the simulation. */
    public boolean isFitForImpedance() {
        double[] external = numbers(StateWords.TAU_EXT, AXES);
        double[] speed = numbers(StateWords.DQ, AXES);
        for (int i = 0; i < AXES; i++) {
            if (Math.abs(external[i]) >= LARGEST_EXTERNAL || Math.abs(speed[i]) > AT_REST) {
                return false;
            }
        }
        return Math.abs(numbers(StateWords.Q, AXES)[3]) > SINGULAR;
    }

    /** Blocks until the motion has ended; an error is thrown. */
    public IMotionContainer moveFrame(ObjectFrame moved, IMotion motion, IMotionContainerListener listener) {
        MotionContainer container = submit(moved, motion, listener, false);
        container.await();
        if (container.hasError()) {
            throw new CommandInvalidException(container.getErrorMessage());
        }
        return container;
    }

    /** Returns at once; an error goes to the application's handler. */
    public IMotionContainer moveFrameAsync(ObjectFrame moved, IMotion motion, IMotionContainerListener listener) {
        return submit(moved, motion, listener, true);
    }

    private MotionContainer submit(ObjectFrame moved, IMotion motion, IMotionContainerListener listener, boolean asynchronous) {
        long id = ids.incrementAndGet();
        MotionOrder order = MotionTranslator.of(id, motion, moved, this);
        MotionContainer container = new MotionContainer(id, motion, station, listener, this::ended);
        container.appendBy(more -> append(container, moved, more));
        if (motion instanceof ServoMotion) {
            serve((ServoMotion<?>) motion, container, moved);
        }
        synchronized (open) {
            open.put(container, asynchronous);
        }
        String error;
        try {
            error = station.plant.submit(order, container);
        } catch (RuntimeException e) {
            synchronized (open) {
                open.remove(container);
            }
            throw e;
        }
        if (error != null) {
            container.finished(EndCause.ERROR, error);
        } else {
            reportWait(motion);
        }
        return container;
    }

    /** A motion that waits for the operator looks like a program that hangs: the log shows what to type, as for dialogs. */
    private void reportWait(IMotion motion) {
        long flags = station.sharedState.integer(StateWords.FLAGS);
        boolean isReleased = getOperationMode() != OperationMode.AUT && (flags & SafetyFlags.ENABLED) == 0;
        String steps = (flags & STOPS) != 0 ? "`clear` and `start`" : (flags & SafetyFlags.PAUSED) == 0 ? ""
                : isReleased ? "`enable` and `start`" : "`start`";
        if (!steps.isEmpty()) {
            ApplicationServices.current().logger.warn(motion + " waits for the operator, since the arm is paused: type " + steps);
        }
    }

    private void append(MotionContainer container, ObjectFrame moved, IMotion motion) {
        long id = ids.incrementAndGet();
        MotionOrder order = MotionTranslator.of(id, motion, moved, this);
        AppendedMotion appended = container.add(id, motion);
        String error = station.plant.submit(order, appended);
        if (error != null) {
            container.remove(appended);
            throw new CommandInvalidException(error);
        }
    }

    private void serve(ServoMotion<?> motion, MotionContainer container, ObjectFrame moved) {
        if (motion instanceof SmartServo) {
            checkLimits(((SmartServo) motion).getStart());
        } else if (motion instanceof DirectServo) {
            checkLimits(((DirectServo) motion).getStart());
        }
        ServoRuntime runtime = new ServoRuntime(station, this, container, moved, motion.getMode(), motion instanceof SmartServoLIN);
        container.attach(runtime);
        motion.accepted(runtime);
    }

    /** A failed asynchronous motion cancels those queued behind it. */
    private void ended(MotionContainer container) {
        Boolean asynchronous;
        List<IMotionContainer> tail = new ArrayList<>();
        synchronized (open) {
            asynchronous = open.remove(container);
            if (container.hasError()) {
                tail.addAll(open.keySet());
            }
        }
        if (container.hasError() && Boolean.TRUE.equals(asynchronous)) {
            tail.removeIf(other -> ((MotionContainer) other).precedes(container));
            for (IMotionContainer other : tail) {
                other.cancel();
            }
            ApplicationServices.ofApplication().failed(container, tail);
        }
    }

    /** Number of running and queued motions. */
    public int activeContainers() {
        int count = 0;
        synchronized (open) {
            for (MotionContainer container : open.keySet()) {
                count += container.isFinished() ? 0 : 1;
            }
        }
        return count;
    }
}
