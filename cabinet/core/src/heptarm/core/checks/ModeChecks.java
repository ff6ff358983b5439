package heptarm.core;

import heptarm.wire.CartesianImpedance;
import heptarm.wire.Code;
import heptarm.wire.Mode;
import heptarm.wire.SineImpedance;

/** What has to hold between the fields of a control mode; the ranges of single fields are checked before. */
final class ModeRules {
    /** Largest stiffness about an axis [Nm/rad]. */
    private static final double STIFFEST_ROTATION = 300.0;

    private ModeRules() {
    }

    static void check(Mode mode, String path) throws Refusal {
        if (mode instanceof CartesianImpedance) {
            check((CartesianImpedance) mode, path);
        } else if (mode instanceof SineImpedance) {
            SineImpedance pattern = (SineImpedance) mode;
            check(pattern.base, path + "base.");
            check(pattern, path);
        }
    }

    private static void check(CartesianImpedance spring, String path) throws Refusal {
        for (int i = 3; i < spring.stiffness.length; i++) {
            if (spring.stiffness[i] > STIFFEST_ROTATION) {
                throw new Refusal(Code.OUT_OF_RANGE, path + "stiffness[" + i + "]", Double.toString(spring.stiffness[i]),
                        "[0.0, " + STIFFEST_ROTATION + "] Nm/rad", "the stiffness about an axis is " + spring.stiffness[i]
                                + " Nm/rad; it may be " + STIFFEST_ROTATION + " at most");
            }
        }
        boolean limited = false;
        for (int i = 0; i < spring.max_force.length; i++) {
            limited |= !Double.isNaN(spring.max_force[i]);
        }
        if (spring.max_force_stops && !limited) {
            throw new Refusal(Code.OUT_OF_RANGE, path + "max_force_stops", "true", "false",
                    "max_force_stops is given without a max_force");
        }
    }

    private static void check(SineImpedance pattern, String path) throws Refusal {
        double ramps = pattern.rise_time + pattern.fall_time;
        if (ramps > pattern.total_time) {
            throw new Refusal(Code.OUT_OF_RANGE, path + "total_time", Double.toString(pattern.total_time),
                    "at least " + ramps + " s", "rise_time and fall_time take " + ramps + " s; total_time is "
                            + pattern.total_time + " s");
        }
        if (pattern.stay_active && Double.isNaN(pattern.total_time) && Double.isNaN(pattern.hold_time)) {
            throw new Refusal(Code.OUT_OF_RANGE, path + "stay_active", "true", "false",
                    "stay_active waits for a pattern without an end");
        }
    }

    /** Whose axes a mode's directions are; "tool" for the moved frame and for modes without directions. */
    static String frame(Mode mode) {
        String name = "tool";
        if (mode instanceof CartesianImpedance) {
            name = ((CartesianImpedance) mode).frame;
        } else if (mode instanceof SineImpedance) {
            name = ((SineImpedance) mode).base.frame;
        }
        return name.length() == 0 ? "tool" : name;
    }
}
