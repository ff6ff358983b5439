package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.core.Log;
import heptarm.core.api.Arm;

/** The robot of this cabinet for your own applications: heptarm's motions and checks without any network. */
public final class CabinetArm {
    private CabinetArm() {
    }

    /**
     * An arm for an application, which must close it in its dispose(). The process data heptarm.tools, heptarm.frames and
     * heptarm.io name tools of the project, taught frames and signals, as for heptarm's own application.
     */
    public static Arm of(LBR lbr, RoboticsAPIApplication application) {
        Log log = new TaskLog(application.getLogger(), true);
        SunrisePanel panel = new SunrisePanel(application.getApplicationData(), application.getApplicationUI(), log);
        ProcessSettings settings = new ProcessSettings(application.getApplicationData(), log);
        return Arm.alone(SunriseRobot.of(lbr, application, panel, settings, log), log);
    }
}
