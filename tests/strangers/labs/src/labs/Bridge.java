package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

import javax.inject.Inject;

import com.kuka.common.Pair;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.math.Vector;

/** Moves while a background task sends the state to the PC. */
public class Bridge extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    @Override
    public void run() throws Exception {
        Pair<JointPosition, JointPosition> ends = new Pair<JointPosition, JointPosition>(
                new JointPosition(0, 0.4, 0, -1.3, 0, 1.0, 0), new JointPosition(-0.2, 0.5, 0.1, -1.2, 0.1, 1.1, -0.1));
        getTaskManager().getTask(StateSender.class).startInstance();
        lbr.move(ptp(ends.getA()).setJointVelocityRel(0.8));
        lbr.move(ptp(ends.getB()).setJointVelocityRel(0.8));
        int enough = StateSender.sent + 2; // the first of them may have been under way
        while (StateSender.sent < enough) {
            Thread.sleep(1);
        }
        getTaskManager().getTask(StateSender.class).stopAllInstances();
        Vector lever = Vector.of(3, 4, 12);
        Report.line(getApplicationData(), "Bridge " + (lever.length() == 13.0 && lever.get(1) == 4.0));
        Report.joints(getApplicationData(), "Bridge", lbr);
    }
}
