package heptarm.core.api;

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
import heptarm.wire.Pose;
import heptarm.wire.ShearForceAbove;
import heptarm.wire.SignalIs;
import heptarm.wire.SignalOutside;
import heptarm.wire.TorqueOutside;

/**
 * A condition for {@link Move#until} and {@link Move#trigger}, in SI units; combine conditions with {@link #and}, {@link #or} and
 * {@link #not}.
 *
 * <p>Forces and torques are external ones at the motion frame, in its own axes; {@link #of} takes leaves with another frame, with
 * the axes of a pose in the base, or with a tolerance for the inaccuracy of the estimate.
 */
public final class StopCondition {
    private static final double ANY = Double.NaN;
    private static final Pose OWN = null;

    private final ConditionNode[] nodes; // postfix

    private StopCondition(ConditionNode[] nodes) {
        this.nodes = nodes;
    }

    /** A leaf with all its parameters. */
    public static StopCondition of(ConditionNode leaf) {
        return new StopCondition(new ConditionNode[] {leaf});
    }

    /** The force is above a threshold [N]. */
    public static StopCondition force(double newtons) {
        return of(new ForceAbove("", newtons, ANY, OWN));
    }

    /** The force along an axis, in either direction, is above a threshold [N]. */
    public static StopCondition normalForce(Axis axis, double newtons) {
        return of(new NormalForceAbove("", axis, newtons, ANY, OWN));
    }

    /** The force perpendicular to an axis is above a threshold [N]. */
    public static StopCondition shearForce(Axis axis, double newtons) {
        return of(new ShearForceAbove("", axis, newtons, ANY, OWN));
    }

    /** A component of the force is outside [low, high] [N]. */
    public static StopCondition force(Axis axis, double low, double high) {
        return of(new ForceOutside("", axis, low, high, ANY, OWN));
    }

    /** A component of the torque is outside [low, high] [Nm]. */
    public static StopCondition torque(Axis axis, double low, double high) {
        return of(new TorqueOutside("", axis, low, high, ANY, OWN));
    }

    /** The external torque of a joint, 1 to 7, is outside [low, high] [Nm]. */
    public static StopCondition jointTorque(int joint, double low, double high) {
        return of(new JointTorqueOutside(joint - 1, low, high));
    }

    /** A boolean signal has a value; signals are named "group.name". */
    public static StopCondition signal(String name, boolean value) {
        return of(new SignalIs(name, value));
    }

    /** A number signal is outside [low, high]. */
    public static StopCondition signal(String name, double low, double high) {
        return of(new SignalOutside(name, low, high));
    }

    /** The motion is this far from the start of its path [m]. */
    public static StopCondition pathFromStart(double metres) {
        return of(new PathReached(PathReference.START, metres, 0.0));
    }

    /** The motion is this far from the end of its path [m]. */
    public static StopCondition pathToEnd(double metres) {
        return of(new PathReached(PathReference.DESTINATION, -metres, 0.0));
    }

    /** Both conditions are true. */
    public StopCondition and(StopCondition other) {
        return joined(other, new AllOf(2));
    }

    /** At least one condition is true. */
    public StopCondition or(StopCondition other) {
        return joined(other, new AnyOf(2));
    }

    /** The condition is false. */
    public StopCondition not() {
        ConditionNode[] all = java.util.Arrays.copyOf(nodes, nodes.length + 1);
        all[nodes.length] = new Inverted();
        return new StopCondition(all);
    }

    private StopCondition joined(StopCondition other, ConditionNode by) {
        ConditionNode[] all = java.util.Arrays.copyOf(nodes, nodes.length + other.nodes.length + 1);
        System.arraycopy(other.nodes, 0, all, nodes.length, other.nodes.length);
        all[all.length - 1] = by;
        return new StopCondition(all);
    }

    /** The condition for the protocol; the node that fires is identified by its index in this list. */
    public Condition condition() {
        return new Condition(nodes.clone());
    }
}
