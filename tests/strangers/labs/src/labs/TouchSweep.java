package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.ForceCondition;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.JointTorqueCondition;
import com.kuka.roboticsAPI.deviceModel.JointEnum;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.RelativeSplineMotionCP;

/** Searches along the axes of the world with relative lines, each with a guard of several conditions. */
public class TouchSweep extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    @Override
    public void run() throws Exception {
        lbr.move(ptp(0.3, 0.4, 0.2, -1.3, 0.1, 1.0, 0.4).setJointVelocityRel(0.8));
        Frame start = lbr.getCurrentCartesianPosition(lbr.getFlange());
        ICondition torque = new JointTorqueCondition(JointEnum.J1, -40, 40);
        ICondition force = ForceCondition.createSpatialForceCondition(lbr.getFlange(), 60.0);
        ICondition contact = torque.or(force, new JointTorqueCondition(JointEnum.J2, -60, 60)).and(torque.invert(), force.xor(torque));
        RelativeSplineMotionCP<?> side = linRel(0, 30, 0, 0, 0, 0).setReferenceFrame(World.Current.getRootFrame());
        IMotionContainer swept = lbr.move(side.setZOffset(-20).setCartVelocity(120).breakWhen(contact));
        Frame now = lbr.getCurrentCartesianPosition(lbr.getFlange());
        Transformation moved = Transformation.ofTranslation(now.getX() - start.getX(), now.getY() - start.getY(), now.getZ() - start.getZ());
        boolean isThere = Math.abs(moved.getX()) < 0.1 && Math.abs(moved.getY() - 30) < 0.1 && Math.abs(moved.getZ() + 20) < 0.1;
        lbr.move(lin(start).setCartVelocity(120));
        boolean isSame = moved.withTranslation(1, 2, 3).withRotationRad(0.1, 0, 0).getAlphaRad() > 0.09;
        Report.line(getApplicationData(), "TouchSweep " + isThere + " " + isSame + " " + (swept.getFiredBreakConditionInfo() == null));
        Report.joints(getApplicationData(), "TouchSweep", lbr);
    }
}
