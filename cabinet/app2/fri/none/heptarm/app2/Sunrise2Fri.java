package heptarm.app2;

import com.kuka.sensitivity.LBR;

import heptarm.core.CommandRejected;
import heptarm.core.robot.FriSession;
import heptarm.wire.Code;
import heptarm.wire.FriOpen;

/** No FRI: the sources were written without it. */
final class Sunrise2Fri {
    static final String[] CAPABILITIES = {};

    private Sunrise2Fri() {
    }

    static void check(FriOpen open) throws CommandRejected {
        throw new CommandRejected(Code.UNSUPPORTED,
                "FRI was left out of this cabinet's sources; write them with install-cabinet --sunrise 2 --fri");
    }

    static FriSession of(FriOpen open, LBR lbr, Sunrise2Motions motions, FriSession.Listener listener) throws CommandRejected {
        check(open);
        return null;
    }
}
