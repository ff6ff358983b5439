package heptarm.core;

import heptarm.wire.Code;
import heptarm.wire.HandGuide;
import heptarm.wire.Item;
import heptarm.wire.PathReached;
import heptarm.wire.PositionMode;
import heptarm.wire.RobotInfo;

/** What has to hold between the fields of a hand guiding; the ranges of single fields are checked before. */
final class GuideRules {
    private static final double ROUNDING = 1e-9;

    private GuideRules() {
    }

    static void check(Item item, RobotInfo info, String path) throws Refusal {
        HandGuide guide = (HandGuide) item.motion;
        for (int i = 0; i < info.q_min.length; i++) {
            within(guide.q_min[i], info.q_min[i], info.q_max[i], path + "motion.q_min[" + i + "]");
            within(guide.q_max[i], info.q_min[i], info.q_max[i], path + "motion.q_max[" + i + "]");
            if (guide.q_min[i] >= guide.q_max[i]) {
                throw new Refusal(Code.OUT_OF_RANGE, path + "motion.q_min[" + i + "]", Double.toString(guide.q_min[i]),
                        "below " + guide.q_max[i] + " rad", "the lower limit of A" + (i + 1) + " has to be below the upper one");
            }
        }
        if (item.mode != null && !(item.mode instanceof PositionMode)) {
            throw new Refusal(Code.MODE_CONFLICT, path + "mode", item.mode.getClass().getSimpleName(), "none",
                    "hand guiding is a control mode of its own; give it no other");
        }
        if (item.triggers.length > 0) {
            throw new Refusal(Code.UNSUPPORTED, path + "triggers", Integer.toString(item.triggers.length), "0",
                    "hand guiding has no triggers");
        }
        if (Conditions.contains(item.until, PathReached.class)) {
            throw new Refusal(Code.BAD_CONDITION, path + "until", "PathReached", "", "hand guiding has no path");
        }
    }

    private static void within(double value, double low, double high, String parameter) throws Refusal {
        if (value < low - ROUNDING || value > high + ROUNDING) {
            throw new Refusal(Code.JOINT_LIMIT, parameter, Double.toString(value), "[" + low + ", " + high + "] rad",
                    "a limit of hand guiding lies outside the axis' own");
        }
    }
}
