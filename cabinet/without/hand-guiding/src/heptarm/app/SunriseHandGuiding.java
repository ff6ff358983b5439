package heptarm.app;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.IMotion;

import heptarm.wire.HandGuide;

/** In the place of hand guiding where Workbench lacks it: the same as a cabinet without the option. */
final class SunriseHandGuiding {
    private static final String LEFT_OUT = "left out by heptarm install-cabinet --without hand-guiding";

    private SunriseHandGuiding() {
    }

    static String capability() {
        throw new NoClassDefFoundError(LEFT_OUT);
    }

    static IMotion of(HandGuide guide, LBR robot) {
        throw new NoClassDefFoundError(LEFT_OUT);
    }
}
