package heptarm.app;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.PositionHold;

import heptarm.core.CommandRejected;
import heptarm.core.robot.FriSession;
import heptarm.core.robot.MotionJob;
import heptarm.wire.FriOpen;

/** In the place of FRI where Workbench lacks Sunrise.FRI: the same as a cabinet without the option. */
final class SunriseFri {
    private static final String LEFT_OUT = "left out by heptarm install-cabinet --without fri";

    private SunriseFri() {
    }

    interface Mover {
        MotionJob move(PositionHold hold, MotionJob.Listener listener) throws CommandRejected;
    }

    static FriSession of(FriOpen open, LBR robot, ControlModes modes, SunriseSignals signals, Mover mover, FriSession.Listener listener) {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    static String[] capabilities() {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    static void check(FriOpen open) {
        throw new NoClassDefFoundError(LEFT_OUT);
    }
}
