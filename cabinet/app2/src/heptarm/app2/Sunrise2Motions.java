package heptarm.app2;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.util.HashMap;
import java.util.Iterator;
import java.util.List;
import java.util.Map;
import java.util.concurrent.TimeUnit;

import com.kuka.device.common.JointPosition;
import com.kuka.geometry.LocalFrame;
import com.kuka.motion.IMotion;
import com.kuka.motion.IMotionContainer;
import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IMotionErrorHandler;
import com.kuka.sensitivity.LBR;
import com.kuka.servoing.api.common.IServoingCapability;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.checks.Conditions;
import heptarm.core.robot.FriSession;
import heptarm.core.robot.MotionJob;
import heptarm.core.robot.MotionPort;
import heptarm.core.robot.ServoJob;
import heptarm.wire.Blending;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.FriOpen;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointDynamics;
import heptarm.wire.LinRel;
import heptarm.wire.Mode;
import heptarm.wire.Orientation;
import heptarm.wire.OrientationReference;
import heptarm.wire.OrientationType;
import heptarm.wire.PathReached;
import heptarm.wire.PositionMode;
import heptarm.wire.Ptp;
import heptarm.wire.PtpPose;
import heptarm.wire.ServoOpen;

/**
 * Motions of a Sunrise 2.x cabinet behind the core's port. It refuses what it cannot express with known names, and ignores
 * nothing. It stops by cancelling all its own containers, since how an application cancels everything is unknown.
 */
final class Sunrise2Motions implements MotionPort, IMotionErrorHandler {
    private static final String FLANGE = "flange";
    private static final String TOOL = "tool";

    private final LBR lbr;
    private final IServoingCapability servoing;
    private final Log log;
    private final Map<IMotionContainer, Sunrise2Job> jobs = new HashMap<>();
    private final Map<IMotionContainer, String> orphans = new HashMap<>();

    Sunrise2Motions(LBR lbr, IApplicationControl control, IServoingCapability servoing, Log log) {
        this.lbr = lbr;
        this.servoing = servoing;
        this.log = log;
        control.registerMotionErrorHandler(this);
    }

    /** How a 2.x cabinet reports which condition has fired is unknown, so the core monitors all of them. */
    @Override
    public boolean monitors(Condition condition) {
        return false;
    }

    @Override
    public void check(Item item, String path) throws CommandRejected {
        checkFrame(item.frame, path + "frame");
        if (item.reaction != null) {
            throw Sunrise2Robot.unsupported(path + "reaction", "reactions");
        }
        if (Conditions.contains(item.until, PathReached.class)) {
            throw Sunrise2Robot.unsupported(path + "until", "conditions on the path");
        }
        if (item.motion instanceof Hold) {
            Sunrise2Modes.check(item.mode, path + "mode.");
            return;
        }
        if (item.mode != null && !(item.mode instanceof PositionMode)) {
            throw Sunrise2Robot.unsupported(path + "mode", "impedance control of a motion that is neither a hold nor an overlay");
        }
        String at = path + "motion.";
        if (item.motion instanceof Ptp) {
            Ptp motion = (Ptp) item.motion;
            check(motion.dynamics, at + "dynamics.");
            check(motion.blending, at);
        } else if (item.motion instanceof PtpPose) {
            PtpPose motion = (PtpPose) item.motion;
            if (motion.redundancy.status >= 0) {
                throw Sunrise2Robot.unsupported(at + "redundancy", "redundancy");
            }
            check(motion.dynamics, at + "dynamics.");
            check(motion.blending, at);
        } else if (item.motion instanceof LinRel) {
            check((LinRel) item.motion, at);
        } else {
            throw Sunrise2Robot.unsupported(path + "motion", item.motion.getClass().getSimpleName());
        }
    }

    private static void check(LinRel motion, String at) throws CommandRejected {
        if (!TOOL.equals(motion.reference) && !FLANGE.equals(motion.reference) && !motion.reference.isEmpty()) {
            throw Sunrise2Robot.unsupported(at + "reference", "lines along the axes of " + motion.reference);
        }
        check(motion.joints, at + "joints.");
        check(motion.blending, at);
        CartesianDynamics dynamics = motion.dynamics;
        double[] set = {dynamics.velocity, dynamics.acceleration, dynamics.jerk, dynamics.orientation_velocity,
            dynamics.orientation_acceleration, dynamics.orientation_jerk};
        for (double value : set) {
            if (!Double.isNaN(value)) {
                throw Sunrise2Robot.unsupported(at + "dynamics", "Cartesian velocities; give fractions of the axes' speeds");
            }
        }
        Orientation orientation = motion.orientation;
        if (orientation.type != OrientationType.VARIABLE || orientation.reference != OrientationReference.BASE) {
            throw Sunrise2Robot.unsupported(at + "orientation", "orientation types");
        }
    }

    private static void check(JointDynamics dynamics, String at) throws CommandRejected {
        fraction(dynamics.velocity, at + "velocity");
        fraction(dynamics.acceleration, at + "acceleration");
        for (double jerk : dynamics.jerk) {
            if (!Double.isNaN(jerk)) {
                throw Sunrise2Robot.unsupported(at + "jerk", "a jerk");
            }
        }
    }

    /** The one fraction of all axes; 1 where none is given. */
    private static double fraction(double[] each, String parameter) throws CommandRejected {
        for (double value : each) {
            if (Double.compare(value, each[0]) != 0) {
                throw Sunrise2Robot.unsupported(parameter, "different fractions for the axes");
            }
        }
        return Double.isNaN(each[0]) ? 1.0 : each[0];
    }

    private static void check(Blending blending, String at) throws CommandRejected {
        if (blending.relative > 0 || blending.distance > 0 || blending.orientation > 0) {
            throw Sunrise2Robot.unsupported(at + "blending", "blending");
        }
    }

    private static void checkFrame(String frame, String parameter) throws CommandRejected {
        if (!frame.isEmpty() && !FLANGE.equals(frame)) {
            throw Sunrise2Robot.unsupported(parameter, "motion frames other than the flange");
        }
    }

    @Override
    public MotionJob start(Item item, Mode mode, MotionJob.Listener listener) throws CommandRejected {
        return start(motion(item), listener);
    }

    private IMotion motion(Item item) throws CommandRejected {
        if (item.motion instanceof Ptp) {
            Ptp motion = (Ptp) item.motion;
            return ptp(new JointPosition(motion.q)).setJointVelocityRel(fraction(motion.dynamics.velocity, ""))
                    .setJointAccelerationRel(fraction(motion.dynamics.acceleration, ""));
        }
        if (item.motion instanceof PtpPose) {
            PtpPose motion = (PtpPose) item.motion;
            return ptp(new LocalFrame(lbr.getRootFrame(), Sunrise2Sensors.transformation(motion.target)))
                    .setJointVelocityRel(fraction(motion.dynamics.velocity, ""))
                    .setJointAccelerationRel(fraction(motion.dynamics.acceleration, ""));
        }
        if (item.motion instanceof LinRel) {
            LinRel motion = (LinRel) item.motion;
            return linRel(Sunrise2Sensors.transformation(motion.offset)).setJointVelocityRel(fraction(motion.joints.velocity, ""))
                    .setJointAccelerationRel(fraction(motion.joints.acceleration, ""));
        }
        double duration = ((Hold) item.motion).duration;
        long millis = Double.isNaN(duration) ? -1 : Math.max(1, Math.round(duration * 1000));
        return positionHold(Sunrise2Modes.of(item.mode), millis, TimeUnit.MILLISECONDS);
    }

    /** Start a motion of the flange. */
    MotionJob start(IMotion motion, MotionJob.Listener listener) {
        Sunrise2Job job = new Sunrise2Job(listener);
        try {
            adopt(lbr.getFlange().moveAsync(motion), job);
        } catch (RuntimeException e) {
            log.warn("a motion was refused by the cabinet: " + e);
            job.fail(e.getMessage());
        }
        return job;
    }

    private void adopt(IMotionContainer container, Sunrise2Job job) {
        String failure;
        synchronized (jobs) {
            jobs.put(container, job);
            failure = orphans.remove(container);
            Iterator<Sunrise2Job> known = jobs.values().iterator();
            while (known.hasNext()) {
                if (known.next().isOver()) {
                    known.remove();
                }
            }
        }
        if (failure != null) {
            job.fail(failure);
        }
        job.set(container);
    }

    @Override
    public MotionJob start(Item[] batch, Mode mode, MotionJob.Listener[] listeners) throws CommandRejected {
        throw Sunrise2Robot.unsupported("items", "batches");
    }

    @Override
    public void check(ServoOpen open) throws CommandRejected {
        checkFrame(open.frame, "frame");
        Sunrise2Servo.check(open);
    }

    @Override
    public ServoJob openServo(ServoOpen open, MotionJob.Listener listener) throws CommandRejected {
        Sunrise2Job job = new Sunrise2Job(listener);
        try {
            Sunrise2Servo servo = new Sunrise2Servo(open, lbr, servoing, job);
            adopt(servo.start(), job);
            return servo;
        } catch (RuntimeException e) {
            log.warn("a servo motion was refused by the cabinet: " + e);
            throw new CommandRejected(Code.EXECUTION_FAILED, String.valueOf(e.getMessage()));
        }
    }

    @Override
    public void check(FriOpen open) throws CommandRejected {
        if (open.io.length > 0) {
            throw Sunrise2Robot.unsupported("io", "signals by FRI");
        }
        Sunrise2Modes.check(open.mode, "mode.");
        Sunrise2Fri.check(open);
    }

    @Override
    public FriSession openFri(FriOpen open, FriSession.Listener listener) throws CommandRejected {
        try {
            return Sunrise2Fri.of(open, lbr, this, listener);
        } catch (RuntimeException e) {
            log.warn("an FRI session was refused by the cabinet: " + e);
            throw new CommandRejected(Code.EXECUTION_FAILED, String.valueOf(e.getMessage()));
        }
    }

    /** Receives a failed motion from Sunrise; the error becomes an event, and the application continues. */
    @Override
    public ErrorHandlingAction handleExecutionError(IMotionContainer failed, List<IMotionContainer> cancelled) {
        Sunrise2Job job;
        synchronized (jobs) {
            job = jobs.remove(failed);
            if (job == null) {
                orphans.put(failed, String.valueOf(failed.getErrorMessage()));
            }
        }
        if (job != null) {
            job.fail(failed.getErrorMessage());
        }
        cancel(cancelled);
        return ErrorHandlingAction.IGNORE;
    }

    /** The arm could not hold its position after its last motion. */
    @Override
    public ErrorHandlingAction handleMaintainingError(IMotionContainer last, List<IMotionContainer> cancelled, String text) {
        log.warn("the arm does not hold its position: " + text);
        cancel(cancelled);
        return ErrorHandlingAction.IGNORE;
    }

    private void cancel(List<IMotionContainer> containers) {
        for (IMotionContainer container : containers) {
            Sunrise2Job following;
            synchronized (jobs) {
                following = jobs.get(container);
            }
            if (following != null) {
                following.cancel();
            }
        }
    }

    @Override
    public void stop() {
        Sunrise2Job[] all;
        synchronized (jobs) {
            all = jobs.values().toArray(new Sunrise2Job[0]);
        }
        for (int i = all.length - 1; i >= 0; i--) {
            all[i].cancel();
        }
    }

    /** A cabinet offers applications one kind of braking. */
    @Override
    public void stopFast() {
        stop();
    }

    /** How a 2.x cabinet pauses is unknown; a loss of control that is to pause stops instead. */
    @Override
    public void pause() {
        stop();
    }

    /** Nothing was paused. */
    @Override
    public void resume() {
    }

    /** The core resets the override with each change of control, and sets another one only where the robot has one. */
    @Override
    public void setOverride(double value) {
        if (value != 1.0) {
            throw new IllegalArgumentException("the override must be 1, got " + value);
        }
    }

    /** The application sets none. */
    @Override
    public double override() {
        return 1.0;
    }
}
