package heptarm.core.checks;

import heptarm.core.CommandRejected;
import heptarm.core.robot.Robot;
import heptarm.core.state.SignalTable;
import heptarm.core.tools.ToolTable;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.FriOpen;
import heptarm.wire.HandGuide;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointPoint;
import heptarm.wire.JointSpline;
import heptarm.wire.LinRel;
import heptarm.wire.Mode;
import heptarm.wire.PathReached;
import heptarm.wire.Ptp;
import heptarm.wire.RobotInfo;
import heptarm.wire.Run;
import heptarm.wire.ServoOpen;
import heptarm.wire.SetSignal;
import heptarm.wire.SineImpedance;
import heptarm.wire.Trigger;

/**
 * Checks a request against the robot: joint limits, frames, signals, and what the robot supports. Nothing moves.
 *
 * <p>The generated code has checked the range of each field before.
 */
public final class ProgramChecks {
    private static final double ROUNDING = 1e-9;

    private final Robot robot;
    private final ToolTable tools;
    private final SignalTable signals;

    public ProgramChecks(Robot robot, ToolTable tools, SignalTable signals) {
        this.robot = robot;
        this.tools = tools;
        this.signals = signals;
    }

    public void check(Run run) throws CommandRejected {
        ArcChecks.check(run.items, "items");
        for (int i = 0; i < run.items.length; i++) {
            check(run.items[i], "items[" + i + "].");
        }
    }

    private void check(Item item, String path) throws CommandRejected {
        if (item.motion instanceof Ptp) {
            checkJoints(((Ptp) item.motion).q, path + "motion.q");
        } else if (item.motion instanceof JointSpline) {
            JointPoint[] points = ((JointSpline) item.motion).points;
            for (int k = 0; k < points.length; k++) {
                checkJoints(points[k].q, path + "motion.points[" + k + "].q");
            }
        }
        if (item.motion instanceof HandGuide) {
            HandGuidingChecks.check(item, robot.info, path);
        }
        tools.checkMotionFrame(item.frame, path + "frame");
        if (item.motion instanceof LinRel) {
            tools.checkReference(((LinRel) item.motion).reference, path + "motion.reference");
        }
        checkMode(item.mode, path + "mode.");
        checkCondition(item.until, path + "until");
        checkReaction(item, path);
        checkTriggers(item, path);
        if (item.motion instanceof Hold) {
            checkNoPath(item.until, path + "until", "a hold has no path; use another condition");
        }
        robot.motion.check(item, path);
    }

    public void check(ServoOpen open) throws CommandRejected {
        tools.checkMotionFrame(open.frame, "frame");
        checkMode(open.mode, "mode.");
        checkCondition(open.until, "until");
        checkNoPath(open.until, "until", "a servo motion has no path of its own; use another condition");
        ServoChecks.check(open);
        robot.motion.check(open);
    }

    public void check(FriOpen open) throws CommandRejected {
        checkMode(open.mode, "mode.");
        FriChecks.check(open.io, robot.signals.signals());
        robot.motion.check(open);
    }

    public void checkMode(Mode mode, String path) throws CommandRejected {
        ModeChecks.check(mode, path);
        tools.checkReference(ModeChecks.frame(mode), path + (mode instanceof SineImpedance ? "base.frame" : "frame"));
    }

    /** Refuses joint positions outside the robot's limits. */
    public void checkJoints(double[] q, String path) throws CommandRejected {
        RobotInfo info = robot.info;
        for (int i = 0; i < q.length; i++) {
            if (q[i] < info.q_min[i] - ROUNDING || q[i] > info.q_max[i] + ROUNDING) {
                throw new CommandRejected(Code.JOINT_LIMIT, path + "[" + i + "]", Double.toString(q[i]),
                        "[" + info.q_min[i] + ", " + info.q_max[i] + "] rad",
                        "A" + (i + 1) + " must be in [" + Math.round(Math.toDegrees(info.q_min[i])) + ", "
                                + Math.round(Math.toDegrees(info.q_max[i])) + "] deg on the " + info.title + ", got "
                                + Math.round(Math.toDegrees(q[i]) * 100) / 100.0 + " deg");
            }
        }
    }

    private static void checkReaction(Item item, String path) throws CommandRejected {
        if (item.reaction != null && item.until.nodes.length == 0) {
            throw new CommandRejected(Code.BAD_CONDITION, path + "reaction", item.reaction.getClass().getSimpleName(), "none",
                    "a reaction needs a break condition, got none");
        }
        if (item.reaction != null && item.motion instanceof HandGuide) {
            throw new CommandRejected(Code.UNSUPPORTED, path + "reaction", item.reaction.getClass().getSimpleName(), "none",
                    "hand guiding has no reaction to its break condition; the person holds the arm");
        }
    }

    private void checkCondition(Condition condition, String path) throws CommandRejected {
        Conditions.check(condition, path, robot.signals.signals());
        for (int i = 0; i < condition.nodes.length; i++) {
            tools.checkReference(condition.nodes[i].frame(), path + ".nodes[" + i + "].frame");
        }
    }

    private static void checkNoPath(Condition condition, String path, String why) throws CommandRejected {
        if (Conditions.contains(condition, PathReached.class)) {
            throw new CommandRejected(Code.BAD_CONDITION, path, "PathReached", "", why);
        }
    }

    /** Refuses triggers that would never fire, and actions that cannot be executed. */
    private void checkTriggers(Item item, String path) throws CommandRejected {
        if (item.triggers.length > 0) {
            robot.require("triggers", path + "triggers", "triggers");
        }
        for (int i = 0; i < item.triggers.length; i++) {
            Trigger one = item.triggers[i];
            String at = path + "triggers[" + i + "].";
            if (one.condition.nodes.length == 0) {
                throw new CommandRejected(Code.BAD_CONDITION, at + "condition", "", "", "a trigger needs a condition, got none");
            }
            checkCondition(one.condition, at + "condition");
            if (item.motion instanceof Hold) {
                checkNoPath(one.condition, at + "condition", "a hold has no path; use another condition");
            }
            if (!robot.motion.monitors(one.condition)) {
                throw new CommandRejected(Code.UNSUPPORTED, at + "condition", "SignalOutside", "SignalIs and the others",
                        "the robot cannot trigger on number signals; use a boolean signal");
            }
            if (one.action instanceof SetSignal) {
                signals.check((SetSignal) one.action, at + "action");
            }
        }
    }
}
