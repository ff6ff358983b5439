package heptarm.app;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.circ;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptpHome;

import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.motionModel.CIRC;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.LIN;
import com.kuka.roboticsAPI.motionModel.MotionBatch;
import com.kuka.roboticsAPI.motionModel.OrientationReferenceSystem;
import com.kuka.roboticsAPI.motionModel.RelativeLIN;
import com.kuka.roboticsAPI.motionModel.RobotMotion;
import com.kuka.roboticsAPI.motionModel.SplineMotionCP;
import com.kuka.roboticsAPI.motionModel.SplineOrientationType;

import heptarm.core.CommandRejected;
import heptarm.wire.Blending;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.Circ;
import heptarm.wire.Code;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointDynamics;
import heptarm.wire.JointSpline;
import heptarm.wire.Lin;
import heptarm.wire.LinRel;
import heptarm.wire.Mode;
import heptarm.wire.Motion;
import heptarm.wire.Orientation;
import heptarm.wire.OrientationReference;
import heptarm.wire.OrientationType;
import heptarm.wire.Pose;
import heptarm.wire.Ptp;
import heptarm.wire.PtpHome;
import heptarm.wire.PtpPose;
import heptarm.wire.Redundancy;
import heptarm.wire.ServoOpen;
import heptarm.wire.Spline;

/** Builds Sunrise motions from the items of a program. It refuses what it cannot express, and ignores nothing. */
final class MotionBuilder {
    static final String[] CAPABILITIES = {"ptp", "ptp_pose", "ptp_home", "lin", "lin_rel", "circ", "spline", "spline_joints", "hold", "blending", "override", "pause",
        "conditions", "triggers", "segments", "io", "user_keys", "dialogs", "process_data", "joint_impedance", "cartesian_impedance", "sine_impedance",
        "tools", "workpieces", "frames"};

    private static final int JOINTS = 7;

    private final LBR robot;
    private final SunriseTools tools;
    private final ControlModes modes;
    private final SplineBuilder splines;

    MotionBuilder(LBR robot, SunriseTools tools, ControlModes modes) {
        this.robot = robot;
        this.tools = tools;
        this.modes = modes;
        this.splines = new SplineBuilder(robot);
    }

    /** Refuses an item that this cabinet cannot execute. */
    void check(Item item, String path) throws CommandRejected {
        modes.check(item.mode, tools.motionFrame(item.frame), path + "mode.");
        Motion motion = item.motion;
        String at = path + "motion.";
        if (motion.redundancy() != null) {
            checkRedundancy(motion.redundancy(), at);
        }
        if (motion.orientation() != null) {
            checkOrientation(motion.orientation(), at);
        }
        if (motion instanceof Spline) {
            SplineBuilder.check((Spline) motion, at);
        }
    }

    /** Refuses a servo motion that this cabinet cannot execute. */
    void check(ServoOpen open) throws CommandRejected {
        modes.check(open.mode, tools.motionFrame(open.frame), "mode.");
    }

    private static CommandRejected unsupported(String parameter, String what) {
        return new CommandRejected(Code.UNSUPPORTED, parameter, what, "", "this cabinet application does not support " + what + "; update heptarm on the cabinet");
    }

    private static void checkOrientation(Orientation orientation, String path) throws CommandRejected {
        if (orientation.type == OrientationType.IGNORE) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "orientation.type", "ignore", "variable, constant, joint",
                    "orientation.type must be variable, constant or joint, got ignore; only segments of a spline may ignore the orientation");
        }
        checkOrientationReference(orientation, path);
    }

    static void checkOrientationReference(Orientation orientation, String path) throws CommandRejected {
        if (orientation.type == OrientationType.JOINT && orientation.reference == OrientationReference.PATH) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "orientation.reference", "path", "base",
                    "orientation.reference must be base with orientation.type joint, got path");
        }
    }

    private static void checkRedundancy(Redundancy redundancy, String path) throws CommandRejected {
        if (Double.isNaN(redundancy.e1) != redundancy.status < 0) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "redundancy", "E1 " + redundancy.e1 + ", status " + redundancy.status, "",
                    "E1 and status must both be set or both be left out, got E1 " + redundancy.e1 + ", status " + redundancy.status);
        }
    }

    /** Build the Sunrise motion of a checked item; adds the segments of a spline to the list. */
    RobotMotion<?> motion(Item item, Mode mode, List<IMotion> segments) throws CommandRejected {
        RobotMotion<?> motion = motion(item, segments);
        motion.setMode(modes.of(mode));
        return motion;
    }

    /** Build the Sunrise motions of checked items that form one batch. */
    RobotMotion<?>[] motions(Item[] items) throws CommandRejected {
        RobotMotion<?>[] result = new RobotMotion<?>[items.length];
        for (int i = 0; i < items.length; i++) {
            result[i] = motion(items[i], new ArrayList<IMotion>());
        }
        return result;
    }

    /** Build a batch of motions. */
    RobotMotion<?> batch(RobotMotion<?>[] motions, Mode mode) throws CommandRejected {
        MotionBatch batch = new MotionBatch(motions);
        batch.setMode(modes.of(mode));
        return batch;
    }

    private RobotMotion<?> motion(Item item, List<IMotion> segments) throws CommandRejected {
        Motion motion = item.motion;
        if (motion instanceof Spline) {
            return splines.of((Spline) motion, segments);
        }
        if (motion instanceof JointSpline) {
            return SplineBuilder.of((JointSpline) motion, segments);
        }
        if (motion instanceof Ptp) {
            Ptp one = (Ptp) motion;
            return blended(joints(ptp(new JointPosition(one.q)), one.dynamics), one.blending);
        }
        if (motion instanceof PtpHome) {
            PtpHome one = (PtpHome) motion;
            return blended(joints(ptpHome(), one.dynamics), one.blending);
        }
        if (motion instanceof PtpPose) {
            PtpPose one = (PtpPose) motion;
            return blended(joints(ptp(frame(one.target, one.redundancy)), one.dynamics), one.blending);
        }
        if (motion instanceof Lin) {
            Lin one = (Lin) motion;
            LIN line = lin(frame(one.target, one.redundancy));
            joints(line, one.joints);
            cartesian(line, one.dynamics);
            orientation(line, one.orientation);
            return blended(line, one.blending);
        }
        if (motion instanceof Circ) {
            Circ one = (Circ) motion;
            CIRC arc = circ(new Frame(robot.getRootFrame(), Convert.transformation(one.via)), frame(one.end, one.redundancy));
            joints(arc, one.joints);
            cartesian(arc, one.dynamics);
            orientation(arc, one.orientation);
            return blended(arc, one.blending);
        }
        if (motion instanceof LinRel) {
            LinRel one = (LinRel) motion;
            AbstractFrame axes = tools.reference(one.reference);
            RelativeLIN line = axes == null ? linRel(Convert.transformation(one.offset))
                    : linRel(Convert.transformation(one.offset), axes);
            joints(line, one.joints);
            cartesian(line, one.dynamics);
            orientation(line, one.orientation);
            return blended(line, one.blending);
        }
        if (!(motion instanceof Hold)) {
            throw unsupported("motion", motion.getClass().getSimpleName());
        }
        double duration = ((Hold) motion).duration;
        long millis = Double.isNaN(duration) ? -1 : Math.max(1, Math.round(duration * 1000));
        return positionHold(modes.of(item.mode), millis, TimeUnit.MILLISECONDS);
    }

    private Frame frame(Pose pose, Redundancy redundancy) {
        Frame frame = new Frame(robot.getRootFrame(), Convert.transformation(pose));
        if (redundancy.status >= 0) {
            frame.setRedundancyInformation(robot,
                    new LBRE1Redundancy(redundancy.e1, redundancy.status, Math.max(0, redundancy.turn)));
        }
        return frame;
    }

    private static RobotMotion<?> blended(RobotMotion<?> motion, Blending blending) {
        if (blending.relative > 0) {
            motion.setBlendingRel(blending.relative);
        }
        if (blending.distance > 0) {
            motion.setBlendingCart(Convert.toMillimetres(blending.distance));
        }
        if (blending.orientation > 0) {
            motion.setBlendingOri(blending.orientation);
        }
        return motion;
    }

    static RobotMotion<?> joints(RobotMotion<?> motion, JointDynamics dynamics) {
        motion.setJointVelocityRel(filled(dynamics.velocity));
        motion.setJointAccelerationRel(filled(dynamics.acceleration));
        motion.setJointJerkRel(filled(dynamics.jerk));
        return motion;
    }

    /** Replace NaN by the default, 1. */
    private static double[] filled(double[] fractions) {
        double[] result = new double[JOINTS];
        for (int i = 0; i < JOINTS; i++) {
            result[i] = Double.isNaN(fractions[i]) ? 1.0 : fractions[i];
        }
        return result;
    }

    static void orientation(SplineMotionCP<?> motion, Orientation from) {
        motion.setOrientationType(type(from.type));
        motion.setOrientationReferenceSystem(from.reference == OrientationReference.PATH ? OrientationReferenceSystem.Path
                : OrientationReferenceSystem.Base);
    }

    private static SplineOrientationType type(OrientationType type) {
        switch (type) {
            case CONSTANT:
                return SplineOrientationType.Constant;
            case IGNORE:
                return SplineOrientationType.Ignore;
            case JOINT:
                return SplineOrientationType.OriJoint;
            default:
                return SplineOrientationType.Variable;
        }
    }

    static void cartesian(SplineMotionCP<?> motion, CartesianDynamics dynamics) {
        if (!Double.isNaN(dynamics.velocity)) {
            motion.setCartVelocity(Convert.toMillimetres(dynamics.velocity));
        }
        if (!Double.isNaN(dynamics.acceleration)) {
            motion.setCartAcceleration(Convert.toMillimetres(dynamics.acceleration));
        }
        if (!Double.isNaN(dynamics.jerk)) {
            motion.setCartJerk(Convert.toMillimetres(dynamics.jerk));
        }
        if (!Double.isNaN(dynamics.orientation_velocity)) {
            motion.setOrientationVelocity(dynamics.orientation_velocity);
        }
        if (!Double.isNaN(dynamics.orientation_acceleration)) {
            motion.setOrientationAcceleration(dynamics.orientation_acceleration);
        }
        if (!Double.isNaN(dynamics.orientation_jerk)) {
            motion.setOrientationJerk(dynamics.orientation_jerk);
        }
    }
}
