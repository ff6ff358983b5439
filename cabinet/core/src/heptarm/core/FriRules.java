package heptarm.core;

import heptarm.wire.Code;
import heptarm.wire.IoType;
import heptarm.wire.SignalInfo;

/** What has to hold of the signals that an FRI session shall carry; their number is checked before. */
final class FriRules {
    /** Octets of a name. */
    private static final int LONGEST = 63;

    private FriRules() {
    }

    static void check(String[] names, SignalInfo[] signals) throws Refusal {
        for (int i = 0; i < names.length; i++) {
            String path = "io[" + i + "]";
            SignalInfo info = signals[Signals.of(names[i], signals, path)];
            for (int k = 0; k < i; k++) {
                if (names[k].equals(names[i])) {
                    throw new Refusal(Code.UNKNOWN_NAME, path, names[i], "", names[i] + " is named twice");
                }
            }
            if (info.type == IoType.INTEGER) {
                throw new Refusal(Code.UNSUPPORTED, path, names[i], "boolean, unsigned, analog",
                        names[i] + " is a number with a sign, and FRI carries none");
            }
            if (names[i].length() > LONGEST) {
                throw new Refusal(Code.UNSUPPORTED, path, names[i], LONGEST + " octets",
                        "FRI carries names of at most " + LONGEST + " octets; " + names[i] + " has " + names[i].length());
            }
        }
    }
}
