package heptarm.app;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

import heptarm.core.robot.ServoJob;
import heptarm.wire.Mode;
import heptarm.wire.ServoOpen;

/** In the place of servo motions where Workbench lacks Sunrise.Servoing: the same as a cabinet without the option. */
final class SunriseServo implements ServoJob {
    private static final String LEFT_OUT = "left out by heptarm install-cabinet --without servoing";

    private SunriseServo() {
    }

    static String[] capabilities() {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    static SunriseServo of(ServoOpen open, LBR robot, SunriseTools tools, ControlModes modes, SunriseJob job) {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    IMotionContainer start() {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    public void cancel() {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    public void follow(double[] q, double[] velocity) {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    public void followPose(double[] xyz, double[] quat) {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    public void changeMode(Mode mode) {
        throw new NoClassDefFoundError(LEFT_OUT);
    }
}
