package heptarm.core.motion;

import java.util.Arrays;

import heptarm.core.Clock;
import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.MotionJob;
import heptarm.core.robot.MotionPort;
import heptarm.core.robot.Sensors;
import heptarm.wire.Blending;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointDynamics;
import heptarm.wire.JointImpedance;
import heptarm.wire.Mode;
import heptarm.wire.Motion;
import heptarm.wire.PositionMode;
import heptarm.wire.Ptp;
import heptarm.wire.Retreat;
import heptarm.wire.SineImpedance;
import heptarm.wire.SpiralPattern;
import heptarm.wire.Trigger;

/**
 * What the arm does when a break condition has ended a motion. In position control it would go on pushing against what it has
 * touched, by the distance in which it has braked.
 *
 * <p>Relaxing: the joints are springs of moderate stiffness for a moment. When that ends, the controller holds the position that
 * was reached, since position control after impedance control starts at the measured position.
 */
final class BreakReactions {
    private static final int JOINTS = 7;
    /** Stiffness [Nm/rad], damping ratio and duration [s] of relaxing: compliant beside position control, but an unknown load of 1 kg moves the hand by millimetres only. */
    private static final double STIFFNESS = 1000.0;
    private static final double DAMPING = 1.0;
    private static final double DURATION = 0.2;

    private final MotionPort port;
    private final Sensors sensors;
    private final Clock clock;
    private final Log log;

    BreakReactions(MotionPort port, Sensors sensors, Clock clock, Log log) {
        this.port = port;
        this.sensors = sensors;
        this.clock = clock;
        this.log = log;
    }

    /** A record of an item, or of items that run as one batch, that a break condition may end. */
    ContactLog record(int first, Item item) {
        return new ContactLog(sensors, clock, log, first, item.reaction instanceof Retreat ? (Retreat) item.reaction : null);
    }

    /** Reacts if the condition of an item has ended the program; returns when the arm rests. */
    void react(Program program, Item item) throws InterruptedException {
        if (program.cause() == Cause.CONDITION) {
            if (item.reaction != null) {
                perform(program, item);
            }
            program.contact.rested();
        }
        program.settle();
    }

    private void perform(Program program, Item item) throws InterruptedException {
        try {
            Item reaction = reaction(program, item);
            program.adoptReaction(port.start(reaction, reaction.mode, program.reactionListener()));
            program.awaitReaction();
        } catch (CommandRejected e) {
            program.failReaction(e.code, e.getMessage());
        }
    }

    private static Item reaction(Program program, Item item) throws CommandRejected {
        if (item.reaction instanceof Retreat) {
            double[] back = program.contact.back();
            if (back == null) {
                throw new CommandRejected(Code.EXECUTION_FAILED, "the joints that the arm has passed could not be read");
            }
            double[] speed = each(((Retreat) item.reaction).speed);
            double[] keep = each(Double.NaN);
            return item(new Ptp(back, new JointDynamics(speed, keep, keep), new Blending(0.0, 0.0, 0.0)), item.frame, steady(item.mode));
        }
        return item(new Hold(DURATION), item.frame, new JointImpedance(each(STIFFNESS), each(DAMPING)));
    }

    private static Item item(Motion motion, String frame, Mode mode) {
        return new Item(motion, frame, mode, new Condition(new ConditionNode[0]), new Trigger[0], null);
    }

    /** A control mode without overlaid forces. */
    private static Mode steady(Mode mode) {
        if (mode instanceof SineImpedance) {
            return ((SineImpedance) mode).base;
        }
        return mode == null || mode instanceof SpiralPattern ? new PositionMode() : mode;
    }

    private static double[] each(double value) {
        double[] result = new double[JOINTS];
        Arrays.fill(result, value);
        return result;
    }
}
