package heptarm.app;

/** In the place of Cartesian servo motions where Workbench lacks Sunrise.Servoing. */
final class SunriseServoLin {
    private SunriseServoLin() {
    }

    static String capability() {
        throw new NoClassDefFoundError("left out by heptarm install-cabinet --without servoing");
    }
}
