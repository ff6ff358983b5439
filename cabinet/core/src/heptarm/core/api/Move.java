package heptarm.core;

import heptarm.wire.Action;
import heptarm.wire.Blending;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.Circ;
import heptarm.wire.CircSegment;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.HandGuide;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointDynamics;
import heptarm.wire.JointPoint;
import heptarm.wire.JointSpline;
import heptarm.wire.Lin;
import heptarm.wire.LinRel;
import heptarm.wire.LinSegment;
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
import heptarm.wire.SplSegment;
import heptarm.wire.Spline;
import heptarm.wire.SplineSegment;
import heptarm.wire.Trigger;

/** A motion for {@link Arm}, in SI. Every method gives a new one, so that a motion can be kept and used again. */
public final class Move implements Cloneable {
    private static final int JOINTS = 7;
    private static final double NAN = Double.NaN;
    private static final double[] KEEP = {NAN, NAN, NAN, NAN, NAN, NAN, NAN};

    private enum Kind { PTP, PTP_HOME, PTP_POSE, LIN, LIN_REL, CIRC, SPL, SPLINE, SPLINE_JOINTS, HOLD, HAND_GUIDE }

    private final Kind kind;
    private final double[] q;
    private final Pose target;
    private final Pose via;
    private final double duration;
    private final Move[] parts;
    private JointDynamics joints = new JointDynamics(KEEP, KEEP, KEEP);
    private CartesianDynamics path = new CartesianDynamics(NAN, NAN, NAN, NAN, NAN, NAN);
    private Blending blending = new Blending(0.0, 0.0, 0.0);
    private Orientation orientation = new Orientation(OrientationType.VARIABLE, OrientationReference.BASE);
    private Redundancy redundancy = new Redundancy(NAN, -1, -1);
    private String reference = "";
    private String frame = "";
    private Mode mode;
    private Condition until = new Condition(new ConditionNode[0]);
    private Trigger[] triggers = new Trigger[0];

    private Move(Kind kind, double[] q, Pose target, Pose via, double duration, Move... parts) {
        this.parts = parts;
        this.kind = kind;
        this.q = q;
        this.target = target;
        this.via = via;
        this.duration = duration;
    }

    /** To seven joint positions [rad]. */
    public static Move ptp(double... q) {
        return new Move(Kind.PTP, q.clone(), null, null, 0.0);
    }

    /** To the home position of the cabinet's project: all zeros unless that says otherwise. */
    public static Move home() {
        return new Move(Kind.PTP_HOME, null, null, null, 0.0);
    }

    /** To a pose of the moved frame in the base, by the joints. */
    public static Move ptp(Pose target) {
        return new Move(Kind.PTP_POSE, null, target, null, 0.0);
    }

    /** To a pose of the moved frame in the base, on a straight line. */
    public static Move lin(Pose target) {
        return new Move(Kind.LIN, null, target, null, 0.0);
    }

    /** On a straight line by so much [m], along the moved frame's own axes, or those of {@link #along}. */
    public static Move linRel(double x, double y, double z) {
        return new Move(Kind.LIN_REL, null, pose(x, y, z), null, 0.0);
    }

    /** The same, and a turn about these axes. */
    public static Move linRel(Pose offset) {
        return new Move(Kind.LIN_REL, null, offset, null, 0.0);
    }

    /** On an arc through one pose to another. */
    public static Move circ(Pose via, Pose target) {
        return new Move(Kind.CIRC, null, target, via, 0.0);
    }

    /** A curved segment of a {@link #spline} to a pose. */
    public static Move spl(Pose target) {
        return new Move(Kind.SPL, null, target, null, 0.0);
    }

    /** A curve through poses: of {@link #spl}, {@link #lin} and {@link #circ}, each with limits of its own if it says so. */
    public static Move spline(Move... segments) {
        for (Move one : segments) {
            if (one.kind != Kind.SPL && one.kind != Kind.LIN && one.kind != Kind.CIRC) {
                throw new IllegalArgumentException("a spline consists of spl, lin and circ, not of " + one.kind);
            }
        }
        return new Move(Kind.SPLINE, null, null, null, 0.0, segments.clone());
    }

    /** A curve through joint positions, each a {@link #ptp}. */
    public static Move splineJoints(Move... points) {
        for (Move one : points) {
            if (one.kind != Kind.PTP) {
                throw new IllegalArgumentException("a joint spline consists of ptp to joint positions, not of " + one.kind);
            }
        }
        return new Move(Kind.SPLINE_JOINTS, null, null, null, 0.0, points.clone());
    }

    /** Holds the position for a time [s]; NaN: until it is cancelled. */
    public static Move hold(double duration) {
        return new Move(Kind.HOLD, null, null, null, duration);
    }

    /**
     * A person leads the arm while the switch of the hand guiding device is held, no faster than {@link #velocity}; it ends when
     * the switch is let go.
     */
    public static Move handGuide() {
        return new Move(Kind.HAND_GUIDE, null, null, null, 0.0);
    }

    /** A pose that is not turned: at a place in the base [m]. */
    public static Pose pose(double x, double y, double z) {
        return new Pose(new double[] {x, y, z}, new double[] {0.0, 0.0, 0.0, 1.0});
    }

    /** No axis is faster than this fraction of its maximum, (0, 1]; one for all or seven. */
    public Move speed(double... fractions) {
        Move copy = copy();
        copy.joints = new JointDynamics(each(fractions), joints.acceleration, joints.jerk);
        return copy;
    }

    /** No axis accelerates harder than this fraction of its maximum, (0, 1]; one for all or seven. */
    public Move acceleration(double... fractions) {
        Move copy = copy();
        copy.joints = new JointDynamics(joints.velocity, each(fractions), joints.jerk);
        return copy;
    }

    /** No axis jerks harder than this fraction of its maximum, (0, 1]; one for all or seven. */
    public Move jerk(double... fractions) {
        Move copy = copy();
        copy.joints = new JointDynamics(joints.velocity, joints.acceleration, each(fractions));
        return copy;
    }

    /** Along the path [m/s]. */
    public Move velocity(double metresPerSecond) {
        return along(metresPerSecond, path.acceleration, path.jerk);
    }

    /** Along the path [m/s, m/s², m/s³]; NaN: as the cabinet has it. */
    public Move along(double velocity, double acceleration, double jerk) {
        Move copy = copy();
        copy.path = new CartesianDynamics(velocity, acceleration, jerk, path.orientation_velocity, path.orientation_acceleration,
                path.orientation_jerk);
        return copy;
    }

    /** Of the rotation along the path [rad/s]. */
    public Move turning(double radiansPerSecond) {
        return turning(radiansPerSecond, path.orientation_acceleration, path.orientation_jerk);
    }

    /** Of the rotation along the path [rad/s, rad/s², rad/s³]; NaN: as the cabinet has it. */
    public Move turning(double velocity, double acceleration, double jerk) {
        Move copy = copy();
        copy.path = new CartesianDynamics(path.velocity, path.acceleration, path.jerk, velocity, acceleration, jerk);
        return copy;
    }

    /** How the orientation is led along the path, and relative to what. */
    public Move orientation(OrientationType type, OrientationReference reference) {
        Move copy = copy();
        copy.orientation = new Orientation(type, reference);
        return copy;
    }

    /** Within this distance [m] of its end it may turn into the motion behind it. */
    public Move blending(double metres) {
        return blending(0.0, metres, 0.0);
    }

    /** The same as a fraction of its path, as a distance [m] and as a rotation [rad]; 0: not said. */
    public Move blending(double fraction, double metres, double radians) {
        Move copy = copy();
        copy.blending = new Blending(fraction, metres, radians);
        return copy;
    }

    /** KUKA's arm angle [rad], status and turn at the end. */
    public Move redundancy(double e1, int status, int turn) {
        Move copy = copy();
        copy.redundancy = new Redundancy(e1, status, turn);
        return copy;
    }

    /** Whose axes a relative motion follows: "base", or "" for the moved frame's own. */
    public Move along(String axes) {
        Move copy = copy();
        copy.reference = axes;
        return copy;
    }

    /** The moved frame; "": the attached tool's, without a tool the flange. */
    public Move frame(String name) {
        Move copy = copy();
        copy.frame = name;
        return copy;
    }

    /** The control mode. */
    public Move mode(Mode newMode) {
        Move copy = copy();
        copy.mode = newMode;
        return copy;
    }

    /** Ends early when this comes true. */
    public Move until(Condition condition) {
        Move copy = copy();
        copy.until = condition;
        return copy;
    }

    public Move until(Until condition) {
        return until(condition.condition());
    }

    /** Sets an output or sends an event when a condition comes true, without stopping. */
    public Move trigger(Until condition, Action action) {
        Move copy = copy();
        copy.triggers = java.util.Arrays.copyOf(triggers, triggers.length + 1);
        copy.triggers[triggers.length] = new Trigger(condition.condition(), action);
        return copy;
    }

    private Move copy() {
        try {
            return (Move) clone();
        } catch (CloneNotSupportedException e) {
            throw new AssertionError(e);
        }
    }

    Item item() {
        return new Item(motion(), frame, mode, until, triggers);
    }

    private Motion motion() {
        switch (kind) {
            case PTP:
                return new Ptp(q, joints, blending);
            case PTP_HOME:
                return new PtpHome(joints, blending);
            case PTP_POSE:
                return new PtpPose(target, redundancy, joints, blending);
            case LIN:
                return new Lin(target, redundancy, path, joints, blending, orientation);
            case LIN_REL:
                return new LinRel(target, reference, path, joints, blending, orientation);
            case CIRC:
                return new Circ(via, target, redundancy, path, joints, blending, orientation);
            case SPLINE:
                return new Spline(segments(), path, joints);
            case SPLINE_JOINTS:
                return new JointSpline(points(), joints);
            case HAND_GUIDE:
                return new HandGuide(KEEP, KEEP, NAN, path.velocity, false, false);
            case HOLD:
                return new Hold(duration);
            default:
                throw new IllegalStateException("a curved segment belongs into a spline");
        }
    }

    private SplineSegment[] segments() {
        SplineSegment[] result = new SplineSegment[parts.length];
        for (int i = 0; i < parts.length; i++) {
            Move one = parts[i];
            result[i] = one.kind == Kind.SPL ? new SplSegment(one.target, one.path, one.orientation)
                    : one.kind == Kind.LIN ? new LinSegment(one.target, one.path, one.orientation)
                    : new CircSegment(one.via, one.target, one.path, one.orientation);
        }
        return result;
    }

    private JointPoint[] points() {
        JointPoint[] result = new JointPoint[parts.length];
        for (int i = 0; i < parts.length; i++) {
            result[i] = new JointPoint(parts[i].q, parts[i].joints);
        }
        return result;
    }

    private static double[] each(double[] values) {
        if (values.length != 1 && values.length != JOINTS) {
            throw new IllegalArgumentException("one fraction or seven are wanted, not " + values.length);
        }
        double[] result = new double[JOINTS];
        for (int i = 0; i < JOINTS; i++) {
            result[i] = values[values.length == 1 ? 0 : i];
        }
        return result;
    }
}
