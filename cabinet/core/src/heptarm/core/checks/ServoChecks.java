package heptarm.core.checks;

import heptarm.core.CommandRejected;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.Code;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;

/** Checks between the fields of a servo motion and its targets; the generated code checks the range of each field. */
public final class ServoChecks {
    private static final double DEFAULT_SPEED_TIMEOUT = 0.1;

    private ServoChecks() {
    }

    /** Refuses limits that the servo engine does not support. */
    public static void check(ServoOpen open) throws CommandRejected {
        CartesianDynamics line = open.linear;
        if (open.engine != ServoEngine.SMART && open.timing.speed_timeout != DEFAULT_SPEED_TIMEOUT) {
            throw new CommandRejected(Code.UNSUPPORTED, "timing.speed_timeout", Double.toString(open.timing.speed_timeout),
                    Double.toString(DEFAULT_SPEED_TIMEOUT), "only the servo engine smart supports speed_timeout; leave it out");
        }
        if (open.engine == ServoEngine.LIN) {
            unset(line.jerk, "linear.jerk", "the servo engine lin has no jerk limit; leave it out");
            unset(line.orientation_jerk, "linear.orientation_jerk", "the servo engine lin has no jerk limit; leave it out");
            full(open.velocity, "velocity");
            full(open.acceleration, "acceleration");
            return;
        }
        double[] all = {line.velocity, line.acceleration, line.jerk, line.orientation_velocity, line.orientation_acceleration,
            line.orientation_jerk};
        for (int i = 0; i < all.length; i++) {
            unset(all[i], "linear", "the servo engine " + name(open.engine) + " has no Cartesian limits; leave them out, or use the engine lin");
        }
    }

    private static void unset(double value, String parameter, String why) throws CommandRejected {
        if (!Double.isNaN(value)) {
            throw new CommandRejected(Code.UNSUPPORTED, parameter, Double.toString(value), "NaN", why);
        }
    }

    private static void full(double fraction, String parameter) throws CommandRejected {
        if (fraction != 1.0) {
            throw new CommandRejected(Code.UNSUPPORTED, parameter, Double.toString(fraction), "1",
                    parameter + " must be 1 with the servo engine lin, got " + fraction + "; use linear to limit it");
        }
    }

    /** Refuses targets that the servo engine cannot follow. */
    public static void check(ServoEngine engine, boolean isJoints, boolean hasVelocity) throws CommandRejected {
        if (engine == ServoEngine.LIN && isJoints) {
            throw new CommandRejected(Code.UNSUPPORTED, "q", "joint positions", "poses", "the servo engine lin follows poses, not joint positions; send poses");
        }
        if (engine == ServoEngine.DIRECT && hasVelocity) {
            throw new CommandRejected(Code.UNSUPPORTED, "dq", "a velocity", "",
                    "the servo engine direct takes no target velocity; send none");
        }
    }

    private static String name(ServoEngine engine) {
        return engine == ServoEngine.DIRECT ? "direct" : "smart";
    }
}
