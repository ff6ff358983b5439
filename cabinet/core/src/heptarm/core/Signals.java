package heptarm.core;

import heptarm.wire.Code;
import heptarm.wire.SignalInfo;

/** Signals of the cabinet's IO groups by name. */
final class Signals {
    private Signals() {
    }

    /** Place of a signal in the robot's list. */
    static int of(String name, SignalInfo[] signals, String parameter) throws Refusal {
        for (int i = 0; i < signals.length; i++) {
            if (signals[i].name.equals(name)) {
                return i;
            }
        }
        throw new Refusal(Code.UNKNOWN_NAME, parameter, name, names(signals), "no signal " + name);
    }

    private static String names(SignalInfo[] signals) {
        StringBuilder text = new StringBuilder();
        for (SignalInfo one : signals) {
            text.append(text.length() == 0 ? "" : ", ").append(one.name);
        }
        return text.length() == 0 ? "this cabinet has none (process data heptarm.io)" : text.toString();
    }
}
