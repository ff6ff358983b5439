package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.core.Arm;
import heptarm.core.Log;

/** The robot of this cabinet for applications of one's own: heptarm's motions and checks without any network. */
public final class CabinetArm {
    private CabinetArm() {
    }

    /**
     * To be closed in the application's dispose(). Tools of the project, taught frames and signals are found as heptarm's own
     * application finds them: by the process data heptarm.tools, heptarm.frames and heptarm.io, where there are any.
     */
    public static Arm of(LBR lbr, RoboticsAPIApplication application) {
        Log log = new TaskLog(application.getLogger(), true);
        return Arm.alone(robot(lbr, application, new ProcessSettings(application.getApplicationData(), log), log), log);
    }

    /** The robot with what an application's project has for it. */
    static SunriseRobot robot(LBR lbr, RoboticsAPIApplication application, ProcessSettings settings, Log log) {
        Tools tools = new Tools(lbr, application.getApplicationData(), settings.text("heptarm.tools", ""),
                settings.text("heptarm.frames", ""), log);
        SunriseRobot robot = new SunriseRobot(lbr, tools, application.getApplicationControl(), log);
        robot.heed(application.getRecovery());
        IoSignals signals = new IoSignals(lbr.getController(), settings.text("heptarm.io", IoSignals.FLANGE), log);
        robot.furnish(new CabinetPanel(signals, application.getApplicationData()));
        return robot;
    }
}
