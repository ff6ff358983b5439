package heptarm.core;

import heptarm.wire.AllOf;
import heptarm.wire.AnyOf;
import heptarm.wire.Axis;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.ForceAbove;
import heptarm.wire.ForceOutside;
import heptarm.wire.Inverted;
import heptarm.wire.JointTorqueOutside;
import heptarm.wire.NormalForceAbove;
import heptarm.wire.PathReached;
import heptarm.wire.PathReference;
import heptarm.wire.ShearForceAbove;
import heptarm.wire.SignalIs;
import heptarm.wire.SignalOutside;
import heptarm.wire.TorqueOutside;

/**
 * A condition for {@link Move#until} and {@link Move#trigger}, in SI; {@link #and}, {@link #or} and {@link #not} give new ones.
 *
 * <p>Forces and torques are external ones at the moved frame, in its own axes; {@link #of} takes leaves that say another frame
 * or a largest inaccuracy of the estimate.
 */
public final class Until {
    private static final double ANY = Double.NaN;

    private final ConditionNode[] nodes; // postfix

    private Until(ConditionNode[] nodes) {
        this.nodes = nodes;
    }

    /** A leaf with everything that can be said. */
    public static Until of(ConditionNode leaf) {
        return new Until(new ConditionNode[] {leaf});
    }

    /** The force is larger than this [N]. */
    public static Until force(double newtons) {
        return of(new ForceAbove("", newtons, ANY));
    }

    /** The force along an axis, to either side, is larger than this [N]. */
    public static Until forceAlong(Axis axis, double newtons) {
        return of(new NormalForceAbove("", axis, newtons, ANY));
    }

    /** The force across an axis is larger than this [N]. */
    public static Until forceAcross(Axis axis, double newtons) {
        return of(new ShearForceAbove("", axis, newtons, ANY));
    }

    /** A component of the force is outside [low, high] [N]. */
    public static Until force(Axis axis, double low, double high) {
        return of(new ForceOutside("", axis, low, high, ANY));
    }

    /** A component of the torque is outside [low, high] [Nm]. */
    public static Until torque(Axis axis, double low, double high) {
        return of(new TorqueOutside("", axis, low, high, ANY));
    }

    /** The external torque of a joint, 1 to 7, is outside [low, high] [Nm]. */
    public static Until joint(int joint, double low, double high) {
        return of(new JointTorqueOutside(joint - 1, low, high));
    }

    /** A boolean signal has a value; signals are named "group.name". */
    public static Until signal(String name, boolean value) {
        return of(new SignalIs(name, value));
    }

    /** A number signal is outside [low, high]. */
    public static Until signal(String name, double low, double high) {
        return of(new SignalOutside(name, low, high));
    }

    /** The motion has come so far along its path [m]. */
    public static Until travelled(double metres) {
        return of(new PathReached(PathReference.START, metres, 0.0));
    }

    /** So much of its path [m] is left. */
    public static Until left(double metres) {
        return of(new PathReached(PathReference.DESTINATION, -metres, 0.0));
    }

    /** Both hold. */
    public Until and(Until other) {
        return joined(other, new AllOf(2));
    }

    /** One of them holds, or both. */
    public Until or(Until other) {
        return joined(other, new AnyOf(2));
    }

    /** It does not hold. */
    public Until not() {
        ConditionNode[] all = java.util.Arrays.copyOf(nodes, nodes.length + 1);
        all[nodes.length] = new Inverted();
        return new Until(all);
    }

    private Until joined(Until other, ConditionNode by) {
        ConditionNode[] all = java.util.Arrays.copyOf(nodes, nodes.length + other.nodes.length + 1);
        System.arraycopy(other.nodes, 0, all, nodes.length, other.nodes.length);
        all[all.length - 1] = by;
        return new Until(all);
    }

    /** As the protocol has it; the leaf that fires goes by its place in this list. */
    public Condition condition() {
        return new Condition(nodes.clone());
    }
}
