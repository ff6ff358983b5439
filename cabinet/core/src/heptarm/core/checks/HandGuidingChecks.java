package heptarm.core.checks;

import heptarm.core.CommandRejected;
import heptarm.wire.Code;
import heptarm.wire.HandGuide;
import heptarm.wire.Item;
import heptarm.wire.PathReached;
import heptarm.wire.PositionMode;
import heptarm.wire.RobotInfo;

/** Checks between the fields of a hand guiding motion; the generated code checks the range of each field. */
public final class HandGuidingChecks {
    private static final double ROUNDING = 1e-9;

    private HandGuidingChecks() {
    }

    public static void check(Item item, RobotInfo info, String path) throws CommandRejected {
        HandGuide guide = (HandGuide) item.motion;
        for (int i = 0; i < info.q_min.length; i++) {
            within(guide.q_min[i], info.q_min[i], info.q_max[i], path + "motion.q_min[" + i + "]");
            within(guide.q_max[i], info.q_min[i], info.q_max[i], path + "motion.q_max[" + i + "]");
            if (guide.q_min[i] >= guide.q_max[i]) {
                throw new CommandRejected(Code.OUT_OF_RANGE, path + "motion.q_min[" + i + "]", Double.toString(guide.q_min[i]),
                        "below " + guide.q_max[i] + " rad", "the lower limit of A" + (i + 1) + " must be below " + guide.q_max[i] + " rad, got " + guide.q_min[i] + " rad");
            }
        }
        if (item.mode != null && !(item.mode instanceof PositionMode)) {
            throw new CommandRejected(Code.MODE_CONFLICT, path + "mode", item.mode.getClass().getSimpleName(), "none",
                    "hand guiding is a control mode itself; do not set another one");
        }
        if (item.triggers.length > 0) {
            throw new CommandRejected(Code.UNSUPPORTED, path + "triggers", Integer.toString(item.triggers.length), "0",
                    "hand guiding supports no triggers; remove them");
        }
        if (Conditions.contains(item.until, PathReached.class)) {
            throw new CommandRejected(Code.BAD_CONDITION, path + "until", "PathReached", "", "hand guiding has no path; use another condition");
        }
    }

    private static void within(double value, double low, double high, String parameter) throws CommandRejected {
        if (value < low - ROUNDING || value > high + ROUNDING) {
            throw new CommandRejected(Code.JOINT_LIMIT, parameter, Double.toString(value), "[" + low + ", " + high + "] rad",
                    "a joint limit of hand guiding must be in [" + low + ", " + high + "] rad, got " + value + " rad");
        }
    }
}
