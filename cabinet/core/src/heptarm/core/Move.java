package heptarm.core;

import heptarm.wire.Blending;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.Circ;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.HandGuide;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointDynamics;
import heptarm.wire.Lin;
import heptarm.wire.LinRel;
import heptarm.wire.Mode;
import heptarm.wire.Motion;
import heptarm.wire.Orientation;
import heptarm.wire.OrientationReference;
import heptarm.wire.OrientationType;
import heptarm.wire.Pose;
import heptarm.wire.Ptp;
import heptarm.wire.PtpPose;
import heptarm.wire.Redundancy;
import heptarm.wire.Trigger;

/** A motion for {@link Arm}, in SI. Every method gives a new one, so that a motion can be kept and used again. */
public final class Move implements Cloneable {
    private static final int JOINTS = 7;

    private enum Kind { PTP, PTP_POSE, LIN, LIN_REL, CIRC, HOLD, HAND_GUIDE }

    private final Kind kind;
    private final double[] q;
    private final Pose target;
    private final Pose via;
    private final double duration;
    private double speed = Double.NaN;
    private double acceleration = Double.NaN;
    private double velocity = Double.NaN;
    private double turning = Double.NaN;
    private double blending;
    private Redundancy redundancy = new Redundancy(Double.NaN, -1, -1);
    private String reference = "";
    private String frame = "";
    private Mode mode;
    private Condition until = new Condition(new ConditionNode[0]);

    private Move(Kind kind, double[] q, Pose target, Pose via, double duration) {
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

    /** On an arc through one pose to another. */
    public static Move circ(Pose via, Pose target) {
        return new Move(Kind.CIRC, null, target, via, 0.0);
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

    /** No axis is faster than this fraction of its maximum, (0, 1]. */
    public Move speed(double fraction) {
        Move copy = copy();
        copy.speed = fraction;
        return copy;
    }

    /** No axis accelerates harder than this fraction of its maximum, (0, 1]. */
    public Move acceleration(double fraction) {
        Move copy = copy();
        copy.acceleration = fraction;
        return copy;
    }

    /** Along the path [m/s]. */
    public Move velocity(double metresPerSecond) {
        Move copy = copy();
        copy.velocity = metresPerSecond;
        return copy;
    }

    /** Of the rotation along the path [rad/s]. */
    public Move turning(double radiansPerSecond) {
        Move copy = copy();
        copy.turning = radiansPerSecond;
        return copy;
    }

    /** Within this distance [m] of its end it may turn into the motion behind it. */
    public Move blending(double metres) {
        Move copy = copy();
        copy.blending = metres;
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

    private Move copy() {
        try {
            return (Move) clone();
        } catch (CloneNotSupportedException e) {
            throw new AssertionError(e);
        }
    }

    Item item() {
        return new Item(motion(), frame, mode, until, new Trigger[0]);
    }

    private Motion motion() {
        JointDynamics joints = new JointDynamics(all(speed), all(acceleration), all(Double.NaN));
        double nan = Double.NaN;
        CartesianDynamics path = new CartesianDynamics(velocity, nan, nan, turning, nan, nan);
        Blending blend = new Blending(0.0, blending, 0.0);
        Orientation led = new Orientation(OrientationType.VARIABLE, OrientationReference.BASE);
        switch (kind) {
            case PTP:
                return new Ptp(q, joints, blend);
            case PTP_POSE:
                return new PtpPose(target, redundancy, joints, blend);
            case LIN:
                return new Lin(target, redundancy, path, joints, blend, led);
            case LIN_REL:
                return new LinRel(target, reference, path, joints, blend, led);
            case CIRC:
                return new Circ(via, target, redundancy, path, joints, blend, led);
            case HAND_GUIDE:
                return new HandGuide(all(nan), all(nan), nan, velocity, false, false);
            default:
                return new Hold(duration);
        }
    }

    private static double[] all(double value) {
        double[] result = new double[JOINTS];
        java.util.Arrays.fill(result, value);
        return result;
    }
}
