package heptarm.core;

import heptarm.wire.CartesianDynamics;
import heptarm.wire.Code;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;

/** What has to hold between the fields of a servo motion and its targets; the ranges of single fields are checked before. */
final class ServoRules {
    private static final double USUAL_SPEED_TIMEOUT = 0.1;

    private ServoRules() {
    }

    /** Refuses limits that the engine does not have. */
    static void check(ServoOpen open) throws Refusal {
        CartesianDynamics line = open.linear;
        if (open.engine != ServoEngine.SMART && open.speed_timeout != USUAL_SPEED_TIMEOUT) {
            throw new Refusal(Code.UNSUPPORTED, "speed_timeout", Double.toString(open.speed_timeout),
                    Double.toString(USUAL_SPEED_TIMEOUT), "only the engine smart follows targets with a velocity");
        }
        if (open.engine == ServoEngine.LIN) {
            without(line.jerk, "linear.jerk", "the engine lin has no limit of the jerk");
            without(line.orientation_jerk, "linear.orientation_jerk", "the engine lin has no limit of the jerk");
            whole(open.velocity, "velocity");
            whole(open.acceleration, "acceleration");
            return;
        }
        double[] all = {line.velocity, line.acceleration, line.jerk, line.orientation_velocity, line.orientation_acceleration,
            line.orientation_jerk};
        for (int i = 0; i < all.length; i++) {
            without(all[i], "linear", "limits along lines belong to the engine lin, not to " + name(open.engine));
        }
    }

    private static void without(double value, String parameter, String why) throws Refusal {
        if (!Double.isNaN(value)) {
            throw new Refusal(Code.UNSUPPORTED, parameter, Double.toString(value), "NaN", why);
        }
    }

    private static void whole(double fraction, String parameter) throws Refusal {
        if (fraction != 1.0) {
            throw new Refusal(Code.UNSUPPORTED, parameter, Double.toString(fraction), "1",
                    "the engine lin does not heed fractions of the axes' maxima; limit it by linear");
        }
    }

    /** Refuses targets that the engine does not follow. */
    static void check(ServoEngine engine, Stream.Target target) throws Refusal {
        if (engine == ServoEngine.LIN && target.q != null) {
            throw new Refusal(Code.UNSUPPORTED, "q", "joint positions", "poses", "the engine lin follows poses, not joint positions");
        }
        if (engine == ServoEngine.DIRECT && target.velocity != null) {
            throw new Refusal(Code.UNSUPPORTED, "dq", "a velocity", "",
                    "the engine direct passes its targets at the speed that the next ones make; send no velocity");
        }
    }

    private static String name(ServoEngine engine) {
        return engine == ServoEngine.DIRECT ? "direct" : "smart";
    }
}
