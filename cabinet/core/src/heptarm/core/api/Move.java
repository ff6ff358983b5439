package heptarm.core.api;

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
import heptarm.wire.Reaction;
import heptarm.wire.Redundancy;
import heptarm.wire.Relax;
import heptarm.wire.Retreat;
import heptarm.wire.SplSegment;
import heptarm.wire.Spline;
import heptarm.wire.SplineSegment;
import heptarm.wire.Trigger;

/** A motion for {@link Arm}, in SI units. Immutable: every method returns a new one, so a motion can be reused. */
public final class Move implements Cloneable {
    private static final int JOINTS = 7;
    private static final double NAN = Double.NaN;
    private static final double RETREAT_SPEED = 0.1;
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
    private Reaction reaction;

    private Move(Kind kind, double[] q, Pose target, Pose via, double duration, Move... parts) {
        this.parts = parts;
        this.kind = kind;
        this.q = q;
        this.target = target;
        this.via = via;
        this.duration = duration;
    }

    /** Point to point to seven joint positions [rad]. */
    public static Move ptp(double... q) {
        return new Move(Kind.PTP, q.clone(), null, null, 0.0);
    }

    /** Point to point to the home position of the cabinet's project, by default all zeros. */
    public static Move home() {
        return new Move(Kind.PTP_HOME, null, null, null, 0.0);
    }

    /** Point to point to a pose of the motion frame in the base. */
    public static Move ptp(Pose target) {
        return new Move(Kind.PTP_POSE, null, target, null, 0.0);
    }

    /** Straight line to a pose of the motion frame in the base. */
    public static Move lin(Pose target) {
        return new Move(Kind.LIN, null, target, null, 0.0);
    }

    /** Straight line by an offset [m] along the motion frame's own axes, or those of {@link #along}. */
    public static Move linRel(double x, double y, double z) {
        return new Move(Kind.LIN_REL, null, pose(x, y, z), null, 0.0);
    }

    /** Straight line by an offset and a rotation about the same axes. */
    public static Move linRel(Pose offset) {
        return new Move(Kind.LIN_REL, null, offset, null, 0.0);
    }

    /** Arc through one pose to another. */
    public static Move circ(Pose via, Pose target) {
        return new Move(Kind.CIRC, null, target, via, 0.0);
    }

    /** Curved segment of a {@link #spline} to a pose. */
    public static Move spl(Pose target) {
        return new Move(Kind.SPL, null, target, null, 0.0);
    }

    /** Curve through poses, of {@link #spl}, {@link #lin} and {@link #circ} segments, each with optional limits of its own. */
    public static Move spline(Move... segments) {
        for (Move one : segments) {
            if (one.kind != Kind.SPL && one.kind != Kind.LIN && one.kind != Kind.CIRC) {
                throw new IllegalArgumentException("a segment of a spline must be spl, lin or circ, got " + one.kind);
            }
        }
        return new Move(Kind.SPLINE, null, null, null, 0.0, segments.clone());
    }

    /** Curve through joint positions, each a {@link #ptp}. */
    public static Move splineJoints(Move... points) {
        for (Move one : points) {
            if (one.kind != Kind.PTP) {
                throw new IllegalArgumentException("a point of a joint spline must be a ptp to joint positions, got " + one.kind);
            }
        }
        return new Move(Kind.SPLINE_JOINTS, null, null, null, 0.0, points.clone());
    }

    /** Hold the position for a time [s]; NaN: until it is cancelled. */
    public static Move hold(double duration) {
        return new Move(Kind.HOLD, null, null, null, duration);
    }

    /**
     * Hand guiding, at most as fast as {@link #velocity}: a person moves the arm while holding the switch of the hand guiding
     * device; releasing the switch ends it.
     */
    public static Move handGuide() {
        return new Move(Kind.HAND_GUIDE, null, null, null, 0.0);
    }

    /** A pose without rotation, at a position in the base [m]. */
    public static Pose pose(double x, double y, double z) {
        return new Pose(new double[] {x, y, z}, new double[] {0.0, 0.0, 0.0, 1.0});
    }

    /** Limit the joint velocities to fractions of their maxima, in (0, 1]; one for all or seven. */
    public Move speed(double... fractions) {
        Move copy = copy();
        copy.joints = new JointDynamics(each(fractions), joints.acceleration, joints.jerk);
        return copy;
    }

    /** Limit the joint accelerations to fractions of their maxima, in (0, 1]; one for all or seven. */
    public Move acceleration(double... fractions) {
        Move copy = copy();
        copy.joints = new JointDynamics(joints.velocity, each(fractions), joints.jerk);
        return copy;
    }

    /** Limit the joint jerks to fractions of their maxima, in (0, 1]; one for all or seven. */
    public Move jerk(double... fractions) {
        Move copy = copy();
        copy.joints = new JointDynamics(joints.velocity, joints.acceleration, each(fractions));
        return copy;
    }

    /** Limit the velocity along the path [m/s]. */
    public Move velocity(double metresPerSecond) {
        return cartesian(metresPerSecond, path.acceleration, path.jerk);
    }

    /** Limit velocity, acceleration and jerk along the path [m/s, m/s², m/s³]; NaN: the cabinet's default. */
    public Move cartesian(double velocity, double acceleration, double jerk) {
        Move copy = copy();
        copy.path = new CartesianDynamics(velocity, acceleration, jerk, path.orientation_velocity, path.orientation_acceleration,
                path.orientation_jerk);
        return copy;
    }

    /** Limit the rotational velocity along the path [rad/s]. */
    public Move rotational(double radiansPerSecond) {
        return rotational(radiansPerSecond, path.orientation_acceleration, path.orientation_jerk);
    }

    /** Limit rotational velocity, acceleration and jerk [rad/s, rad/s², rad/s³]; NaN: the cabinet's default. */
    public Move rotational(double velocity, double acceleration, double jerk) {
        Move copy = copy();
        copy.path = new CartesianDynamics(path.velocity, path.acceleration, path.jerk, velocity, acceleration, jerk);
        return copy;
    }

    /** Set how the orientation changes along the path, and relative to what. */
    public Move orientation(OrientationType type, OrientationReference reference) {
        Move copy = copy();
        copy.orientation = new Orientation(type, reference);
        return copy;
    }

    /** Blend into the next motion within this distance of the end [m]. */
    public Move blending(double metres) {
        return blending(0.0, metres, 0.0);
    }

    /** Blend into the next motion within a fraction of the path, a distance [m] and a rotation [rad]; 0: unset. */
    public Move blending(double fraction, double metres, double radians) {
        Move copy = copy();
        copy.blending = new Blending(fraction, metres, radians);
        return copy;
    }

    /** Set the redundancy at the end: E1 (the angle of A3) [rad], status and turn. */
    public Move redundancy(double e1, int status, int turn) {
        Move copy = copy();
        copy.redundancy = new Redundancy(e1, status, turn);
        return copy;
    }

    /** Set the axes of a relative motion: "base", or "" for the motion frame's own. */
    public Move along(String axes) {
        Move copy = copy();
        copy.reference = axes;
        return copy;
    }

    /** Set the motion frame; "": the attached tool's, without a tool the flange. */
    public Move frame(String name) {
        Move copy = copy();
        copy.frame = name;
        return copy;
    }

    /** Set the control mode. */
    public Move mode(Mode newMode) {
        Move copy = copy();
        copy.mode = newMode;
        return copy;
    }

    /** End the motion early when a condition becomes true. */
    public Move until(Condition condition) {
        Move copy = copy();
        copy.until = condition;
        return copy;
    }

    /** End the motion early when a condition becomes true. */
    public Move until(StopCondition condition) {
        return until(condition.condition());
    }

    /** Be compliant for a moment when the break condition has ended the motion, then hold the position reached. */
    public Move thenRelax() {
        return then(new Relax());
    }

    /** Move back by a distance [m], at a tenth of the axes' speed, when the break condition has ended the motion. */
    public Move thenRetreat(double metres) {
        return then(new Retreat(metres, RETREAT_SPEED));
    }

    /** React to the end by the break condition; null: stay where the arm has braked. */
    public Move then(Reaction newReaction) {
        Move copy = copy();
        copy.reaction = newReaction;
        return copy;
    }

    /** Set an output or send an event when a condition becomes true, without stopping. */
    public Move trigger(StopCondition condition, Action action) {
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
        return new Item(motion(), frame, mode, until, triggers, reaction);
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
                throw new IllegalStateException("a spl segment must be part of a spline");
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
            throw new IllegalArgumentException("speed, acceleration and jerk take 1 or " + JOINTS + " fractions, got " + values.length);
        }
        double[] result = new double[JOINTS];
        for (int i = 0; i < JOINTS; i++) {
            result[i] = values[values.length == 1 ? 0 : i];
        }
        return result;
    }
}
