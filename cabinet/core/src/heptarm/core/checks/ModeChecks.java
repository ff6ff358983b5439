package heptarm.core.checks;

import heptarm.core.CommandRejected;
import heptarm.wire.CartesianImpedance;
import heptarm.wire.Code;
import heptarm.wire.HandGuidingMode;
import heptarm.wire.Mode;
import heptarm.wire.SineImpedance;

/** Checks between the fields of a control mode; the generated code checks the range of each field. */
public final class ModeChecks {
    /** Largest rotational stiffness [Nm/rad]. */
    private static final double MAX_ROTATIONAL_STIFFNESS = 300.0;

    private ModeChecks() {
    }

    public static void check(Mode mode, String path) throws CommandRejected {
        if (mode instanceof CartesianImpedance) {
            check((CartesianImpedance) mode, path);
        } else if (mode instanceof SineImpedance) {
            SineImpedance pattern = (SineImpedance) mode;
            check(pattern.base, path + "base.");
            check(pattern, path);
        } else if (mode instanceof HandGuidingMode) {
            throw new CommandRejected(Code.UNSUPPORTED, path.substring(0, path.length() - 1), "HandGuidingMode", "",
                    "hand guiding is reported as a mode, but it is started as a motion; run HandGuide");
        }
    }

    private static void check(CartesianImpedance spring, String path) throws CommandRejected {
        for (int i = 3; i < spring.stiffness.length; i++) {
            if (spring.stiffness[i] > MAX_ROTATIONAL_STIFFNESS) {
                throw new CommandRejected(Code.OUT_OF_RANGE, path + "stiffness[" + i + "]", Double.toString(spring.stiffness[i]),
                        "[0.0, " + MAX_ROTATIONAL_STIFFNESS + "] Nm/rad", "the rotational stiffness must be in [0, "
                                + MAX_ROTATIONAL_STIFFNESS + "] Nm/rad, got " + spring.stiffness[i]);
            }
        }
        boolean limited = false;
        for (int i = 0; i < spring.max_force.length; i++) {
            limited |= !Double.isNaN(spring.max_force[i]);
        }
        if (spring.max_force_stops && !limited) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "max_force_stops", "true", "false",
                    "max_force_stops needs a max_force; set max_force, or leave max_force_stops out");
        }
    }

    private static void check(SineImpedance pattern, String path) throws CommandRejected {
        double ramps = pattern.rise_time + pattern.fall_time;
        if (ramps > pattern.total_time) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "total_time", Double.toString(pattern.total_time),
                    "at least " + ramps + " s", "total_time must be at least rise_time + fall_time = "
                            + ramps + " s, got " + pattern.total_time + " s");
        }
        if (pattern.stay_active && Double.isNaN(pattern.total_time) && Double.isNaN(pattern.hold_time)) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "stay_active", "true", "false",
                    "stay_active needs a pattern that ends; set total_time or hold_time");
        }
    }

    /** Name of the frame whose axes a mode uses; "tool" for the motion frame and for modes without directions. */
    public static String frame(Mode mode) {
        String name = "tool";
        if (mode instanceof CartesianImpedance) {
            name = ((CartesianImpedance) mode).frame;
        } else if (mode instanceof SineImpedance) {
            name = ((SineImpedance) mode).base.frame;
        }
        return name.length() == 0 ? "tool" : name;
    }
}
