package heptarm.core.state;

import java.util.Arrays;
import java.util.HashMap;
import java.util.Map;

import heptarm.core.checks.Conditions;
import heptarm.core.robot.Sensors;
import heptarm.core.robot.SignalPort;
import heptarm.wire.AllOf;
import heptarm.wire.AnyOf;
import heptarm.wire.Axis;
import heptarm.wire.ConditionNode;
import heptarm.wire.ForceAbove;
import heptarm.wire.ForceOutside;
import heptarm.wire.Inverted;
import heptarm.wire.JointTorqueOutside;
import heptarm.wire.NormalForceAbove;
import heptarm.wire.Pose;
import heptarm.wire.ShearForceAbove;
import heptarm.wire.SignalInfo;
import heptarm.wire.SignalIs;
import heptarm.wire.SignalOutside;
import heptarm.wire.TorqueOutside;
import heptarm.wire.WrenchState;

/** Evaluates conditions at one moment; reads only what a condition needs, and each value once. */
public final class ConditionReadings {
    private final Sensors sensors;
    private final SignalPort signals;
    private final long stamp;
    private final Map<String, WrenchState> wrenches = new HashMap<String, WrenchState>();
    private double[] external;

    public ConditionReadings(Sensors sensors, SignalPort signals, long stamp) {
        this.sensors = sensors;
        this.signals = signals;
        this.stamp = stamp;
    }

    /** The first tree that is true; null if none is. */
    public Conditions.Tree first(Conditions.Tree[] trees) {
        for (Conditions.Tree tree : trees) {
            if (holds(tree)) {
                return tree;
            }
        }
        return null;
    }

    private boolean holds(Conditions.Tree tree) {
        ConditionNode node = tree.node;
        if (node instanceof AllOf || node instanceof AnyOf) {
            boolean all = node instanceof AllOf;
            for (Conditions.Tree part : tree.parts) {
                if (holds(part) != all) {
                    return !all;
                }
            }
            return all;
        }
        return node instanceof Inverted ? !holds(tree.parts[0]) : leaf(node);
    }

    private boolean leaf(ConditionNode node) {
        if (node instanceof ForceAbove) {
            ForceAbove one = (ForceAbove) node;
            WrenchState seen = wrench(one.frame, one.axes);
            return norm(seen.force) > one.threshold || vague(seen.force_inaccuracy, one.tolerance);
        }
        if (node instanceof NormalForceAbove) {
            NormalForceAbove one = (NormalForceAbove) node;
            WrenchState seen = wrench(one.frame, one.axes);
            return Math.abs(seen.force[one.axis.value()]) > one.threshold || vague(seen.force_inaccuracy, one.tolerance);
        }
        if (node instanceof ShearForceAbove) {
            ShearForceAbove one = (ShearForceAbove) node;
            WrenchState seen = wrench(one.frame, one.axes);
            return across(seen.force, one.axis) > one.threshold || vague(seen.force_inaccuracy, one.tolerance);
        }
        if (node instanceof ForceOutside) {
            ForceOutside one = (ForceOutside) node;
            WrenchState seen = wrench(one.frame, one.axes);
            return outside(seen.force[one.axis.value()], one.low, one.high) || vague(seen.force_inaccuracy, one.tolerance);
        }
        if (node instanceof TorqueOutside) {
            TorqueOutside one = (TorqueOutside) node;
            WrenchState seen = wrench(one.frame, one.axes);
            return outside(seen.torque[one.axis.value()], one.low, one.high) || vague(seen.torque_inaccuracy, one.tolerance);
        }
        if (node instanceof JointTorqueOutside) {
            JointTorqueOutside one = (JointTorqueOutside) node;
            return outside(external()[one.joint], one.low, one.high);
        }
        if (node instanceof SignalIs) {
            return (signal(((SignalIs) node).signal) != 0.0) == ((SignalIs) node).value;
        }
        if (node instanceof SignalOutside) {
            return outside(signal(((SignalOutside) node).signal), ((SignalOutside) node).low, ((SignalOutside) node).high);
        }
        return false; // a point on the path: only the robot itself knows it
    }

    private WrenchState wrench(String frame, Pose axes) {
        String key = axes == null ? frame : Arrays.toString(axes.quat);
        WrenchState seen = wrenches.get(key);
        if (seen == null) {
            seen = sensors.readWrench(frame, axes, stamp);
            wrenches.put(key, seen);
        }
        return seen;
    }

    private double[] external() {
        if (external == null) {
            external = sensors.readTorques(stamp).tau_ext;
        }
        return external;
    }

    private double signal(String name) {
        SignalInfo[] all = signals.signals();
        for (int i = 0; i < all.length; i++) {
            if (all[i].name.equals(name)) {
                double[] value = new double[all.length];
                signals.read(value, i, 1);
                return value[i];
            }
        }
        throw new IllegalStateException("no signal " + name);
    }

    private static boolean outside(double value, double low, double high) {
        return !(value >= low && value <= high);
    }

    /** Whether an estimate is less accurate than the tolerance. */
    private static boolean vague(double[] inaccuracy, double tolerance) {
        return Math.max(Math.max(inaccuracy[0], inaccuracy[1]), inaccuracy[2]) > tolerance;
    }

    private static double norm(double[] v) {
        return Math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }

    private static double across(double[] v, Axis axis) {
        double along = v[axis.value()];
        return Math.sqrt(Math.max(0.0, v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - along * along));
    }
}
