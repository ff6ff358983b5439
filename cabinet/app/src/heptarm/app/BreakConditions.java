package heptarm.app;

import com.kuka.roboticsAPI.conditionModel.BooleanIOCondition;
import com.kuka.roboticsAPI.conditionModel.ForceComponentCondition;
import com.kuka.roboticsAPI.conditionModel.ForceCondition;
import com.kuka.roboticsAPI.conditionModel.ICallbackAction;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.JointTorqueCondition;
import com.kuka.roboticsAPI.conditionModel.MotionPathCondition;
import com.kuka.roboticsAPI.conditionModel.ReferenceType;
import com.kuka.roboticsAPI.conditionModel.TorqueComponentCondition;
import com.kuka.roboticsAPI.deviceModel.JointEnum;
import com.kuka.roboticsAPI.executionModel.IFiredTriggerInfo;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.CoordinateAxis;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

import heptarm.core.CommandRejected;
import heptarm.core.checks.Conditions;
import heptarm.core.robot.MotionJob;
import heptarm.wire.AllOf;
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
import heptarm.wire.Trigger;

/**
 * Builds break conditions and triggers of Sunrise. Each alternative becomes a condition of its own, so that Sunrise reports which
 * one fired; a trigger on the same condition reports it at once, while the motion still brakes.
 */
final class BreakConditions {
    private final Conditions.Tree[] trees;
    private final ICondition[] conditions;

    private BreakConditions(Conditions.Tree[] trees, ICondition[] conditions) {
        this.trees = trees;
        this.conditions = conditions;
    }

    /** Whether Sunrise can monitor a condition. */
    static boolean isSupported(Condition condition) {
        return !Conditions.contains(condition, SignalOutside.class);
    }

    /** Build the conditions for a motion of a frame; none if Sunrise cannot monitor them. */
    static BreakConditions of(Condition until, AbstractFrame moved, SunriseTools tools, SunriseSignals signals) throws CommandRejected {
        Conditions.Tree[] trees = isSupported(until) ? Conditions.alternatives(until) : new Conditions.Tree[0];
        ICondition[] made = new ICondition[trees.length];
        for (int i = 0; i < trees.length; i++) {
            made[i] = make(trees[i], moved, tools, signals);
        }
        return new BreakConditions(trees, made);
    }

    /** Let the conditions end a motion. */
    void addTo(RobotMotion<?> motion, final MotionJob.Listener listener) {
        for (int i = 0; i < conditions.length; i++) {
            final int node = trees[i].index;
            motion.breakWhen(conditions[i]);
            motion.triggerWhen(conditions[i], new ICallbackAction() {
                public void onTriggerFired(IFiredTriggerInfo info) {
                    listener.fired(node);
                }
            });
        }
    }

    /** Report which condition has ended a motion. */
    void report(IMotionContainer ended, MotionJob.Listener listener) {
        for (int i = 0; i < conditions.length; i++) {
            if (ended.hasFired(conditions[i])) {
                listener.fired(trees[i].index);
                return;
            }
        }
    }

    /** Add triggers to a motion; the listener receives their firing. */
    static void addTriggers(RobotMotion<?> motion, Trigger[] triggers, AbstractFrame moved, SunriseTools tools, SunriseSignals signals,
            final MotionJob.Listener listener) throws CommandRejected {
        for (int i = 0; i < triggers.length; i++) {
            final int index = i;
            motion.triggerWhen(make(Conditions.tree(triggers[i].condition), moved, tools, signals), new ICallbackAction() {
                public void onTriggerFired(IFiredTriggerInfo info) {
                    listener.triggered(index);
                }
            });
        }
    }

    private static ICondition make(Conditions.Tree tree, AbstractFrame moved, SunriseTools tools, SunriseSignals signals) throws CommandRejected {
        if (tree.parts.length == 0) {
            return leaf(tree.node, moved, tools, signals);
        }
        ICondition first = make(tree.parts[0], moved, tools, signals);
        if (tree.node instanceof Inverted) {
            return first.invert();
        }
        for (int i = 1; i < tree.parts.length; i++) {
            ICondition next = make(tree.parts[i], moved, tools, signals);
            first = tree.node instanceof AllOf ? first.and(next) : first.or(next);
        }
        return first;
    }

    private static ICondition leaf(ConditionNode node, AbstractFrame moved, SunriseTools tools, SunriseSignals signals) throws CommandRejected {
        if (node instanceof ForceAbove) {
            ForceAbove one = (ForceAbove) node;
            AbstractFrame axes = axes(one.frame, one.axes, moved, tools);
            return Double.isNaN(one.tolerance) ? ForceCondition.createSpatialForceCondition(moved, axes, one.threshold)
                    : ForceCondition.createSpatialForceCondition(moved, axes, one.threshold, one.tolerance);
        }
        if (node instanceof NormalForceAbove) {
            NormalForceAbove one = (NormalForceAbove) node;
            AbstractFrame axes = axes(one.frame, one.axes, moved, tools);
            return Double.isNaN(one.tolerance)
                    ? ForceCondition.createNormalForceCondition(moved, axes, axis(one.axis), one.threshold)
                    : ForceCondition.createNormalForceCondition(moved, axes, axis(one.axis), one.threshold, one.tolerance);
        }
        if (node instanceof ShearForceAbove) {
            ShearForceAbove one = (ShearForceAbove) node;
            AbstractFrame axes = axes(one.frame, one.axes, moved, tools);
            return Double.isNaN(one.tolerance)
                    ? ForceCondition.createShearForceCondition(moved, axes, axis(one.axis), one.threshold)
                    : ForceCondition.createShearForceCondition(moved, axes, axis(one.axis), one.threshold, one.tolerance);
        }
        if (node instanceof ForceOutside) {
            ForceOutside one = (ForceOutside) node;
            AbstractFrame axes = axes(one.frame, one.axes, moved, tools);
            return Double.isNaN(one.tolerance) ? new ForceComponentCondition(moved, axes, axis(one.axis), one.low, one.high)
                    : new ForceComponentCondition(moved, axes, axis(one.axis), one.low, one.high, one.tolerance);
        }
        if (node instanceof TorqueOutside) {
            TorqueOutside one = (TorqueOutside) node;
            AbstractFrame axes = axes(one.frame, one.axes, moved, tools);
            return Double.isNaN(one.tolerance) ? new TorqueComponentCondition(moved, axes, axis(one.axis), one.low, one.high)
                    : new TorqueComponentCondition(moved, axes, axis(one.axis), one.low, one.high, one.tolerance);
        }
        if (node instanceof JointTorqueOutside) {
            JointTorqueOutside one = (JointTorqueOutside) node;
            return new JointTorqueCondition(JointEnum.values()[one.joint], one.low, one.high);
        }
        if (node instanceof SignalIs) {
            SignalIs one = (SignalIs) node;
            return new BooleanIOCondition(signals.signal(one.signal), one.value);
        }
        PathReached one = (PathReached) node;
        return new MotionPathCondition(one.reference == PathReference.START ? ReferenceType.START : ReferenceType.DEST,
                Convert.toMillimetres(one.distance), Math.round(one.delay * 1000));
    }

    private static AbstractFrame axes(String name, Pose given, AbstractFrame moved, SunriseTools tools) throws CommandRejected {
        AbstractFrame found = tools.reference(name, given);
        return found == null ? moved : found;
    }

    private static CoordinateAxis axis(Axis axis) {
        return axis == Axis.X ? CoordinateAxis.X : axis == Axis.Y ? CoordinateAxis.Y : CoordinateAxis.Z;
    }
}
