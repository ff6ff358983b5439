package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.task.ITaskLogger;

import heptarm.core.Arm;
import heptarm.core.Log;

/** The robot of this cabinet for applications of one's own: heptarm's motions and checks without any network. */
public final class CabinetArm {
    private CabinetArm() {
    }

    /** To be closed in the application's dispose(). */
    public static Arm of(LBR lbr, IApplicationControl control, ITaskLogger logger) {
        Log log = new TaskLog(logger, true);
        return Arm.alone(new SunriseRobot(lbr, new Tools(lbr, null, "", "", log), control, log), log);
    }
}
