package heptarm.core.checks;

import heptarm.core.CommandRejected;
import heptarm.core.state.SignalTable;
import heptarm.wire.Code;
import heptarm.wire.IoType;
import heptarm.wire.SignalInfo;

/** Checks the signals that an FRI session is to carry; the generated code checks their number. */
public final class FriChecks {
    /** Longest name [bytes]. */
    private static final int MAX_NAME = 63;

    private FriChecks() {
    }

    public static void check(String[] names, SignalInfo[] signals) throws CommandRejected {
        for (int i = 0; i < names.length; i++) {
            String path = "io[" + i + "]";
            SignalInfo info = signals[SignalTable.index(names[i], signals, path)];
            for (int k = 0; k < i; k++) {
                if (names[k].equals(names[i])) {
                    throw new CommandRejected(Code.UNKNOWN_NAME, path, names[i], "", names[i] + " is listed twice; list each signal once");
                }
            }
            if (info.type == IoType.INTEGER) {
                throw new CommandRejected(Code.UNSUPPORTED, path, names[i], "boolean, unsigned, analog",
                        names[i] + " is a signed number; FRI carries boolean, unsigned and analog signals only");
            }
            if (names[i].length() > MAX_NAME) {
                throw new CommandRejected(Code.UNSUPPORTED, path, names[i], MAX_NAME + " bytes",
                        "the name of an FRI signal must have at most " + MAX_NAME + " bytes, got " + names[i].length() + " (" + names[i] + ")");
            }
        }
    }
}
