package heptarm.app2;

import heptarm.core.CommandRejected;
import heptarm.wire.Code;
import heptarm.wire.FriCommandMode;
import heptarm.wire.FriOpen;

/** What both generations of FRI on Sunrise 2.x have in common: joint positions are the only overlay whose names are known. */
final class Sunrise2Overlays {
    static final String[] CAPABILITIES = {"fri", "fri_monitor", "fri_position"};
    /** Port of FRI on the remote side where none is set. */
    static final int PORT = 30200;
    private static final double LONGEST = 0.01;

    private Sunrise2Overlays() {
    }

    static void check(FriOpen open) throws CommandRejected {
        double answers = open.period * open.receive_multiplier;
        if (open.command != FriCommandMode.MONITOR && open.command != FriCommandMode.POSITION) {
            throw Sunrise2Robot.unsupported("command", "FRI overlays of " + open.command);
        }
        if (Math.abs(open.period * 1000 - milliseconds(open.period)) > 1e-6) {
            throw new CommandRejected(Code.OUT_OF_RANGE, "period", Double.toString(open.period), "whole milliseconds",
                    "period must be a whole number of milliseconds, got " + open.period * 1000 + " ms");
        }
        if (open.command == FriCommandMode.POSITION && answers > LONGEST + 1e-9) {
            throw new CommandRejected(Code.OUT_OF_RANGE, "period", Double.toString(answers), "[0.001, " + LONGEST + "] s",
                    "period * receive_multiplier of a commanding client must be at most " + LONGEST + " s, got " + answers + " s");
        }
    }

    static int milliseconds(double seconds) {
        return (int) Math.round(seconds * 1000);
    }
}
