package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.motionModel.PTP;
import com.kuka.roboticsAPI.motionModel.Spline;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;
import com.kuka.roboticsAPI.persistenceModel.templateModel.FramesTemplate;

/** As every new project has it: a start position, the null space, a spline, a hold in impedance control. */
public class Motions extends RoboticsAPIApplication {
    private Controller kuka_Sunrise_Cabinet_1;
    private LBR lbr_iiwa_7_R800_1;
    private FramesTemplate unused;

    @Override
    public void initialize() {
        kuka_Sunrise_Cabinet_1 = getController("KUKA_Sunrise_Cabinet_1");
        lbr_iiwa_7_R800_1 = (LBR) getDevice(kuka_Sunrise_Cabinet_1, "LBR_iiwa_7_R800_1");
    }

    @Override
    public void run() throws Exception {
        LBR lbr = lbr_iiwa_7_R800_1;
        double speed = 0.01 * (Integer) getApplicationData().getProcessData("speedPercent").getValue();
        PTP toStart = ptp(new JointPosition(0, Math.toRadians(30), 0, Math.toRadians(-70), 0, Math.toRadians(80), 0));
        lbr.move(toStart.setJointVelocityRel(speed));
        Frame start = lbr.getCurrentCartesianPosition(lbr.getFlange());
        Frame turned = start.copyWithRedundancy();
        turned.setRedundancyInformation(lbr, ((LBRE1Redundancy) start.getRedundancyInformationForDevice(lbr)).copy());
        ((LBRE1Redundancy) turned.getRedundancyInformationForDevice(lbr)).setE1(Math.toRadians(-25));
        lbr.move(lin(turned).setCartVelocity(200));
        boolean isTurned = Math.abs(lbr.getCurrentJointPosition().get(2) + Math.toRadians(25)) < 1e-3;
        lbr.move(lin(start).setCartVelocity(200));
        Frame side = start.copyWithRedundancy(lbr.getRootFrame());
        side.setY(side.getY() + 80);
        lbr.move(new Spline(spl(side), spl(start)).setCartVelocity(250));
        CartesianImpedanceControlMode compliant = new CartesianImpedanceControlMode();
        compliant.parametrize(CartDOF.TRANSL).setStiffness(800);
        compliant.setNullSpaceStiffnessToDefaultValue().setNullSpaceDampingToDefaultValue().setAdditionalControlForceToDefaultValue();
        lbr.move(positionHold(compliant, 200, TimeUnit.MILLISECONDS));
        lbr.move(positionHold(new JointImpedanceControlMode(1000, 1000, 1000, 1000, 500, 500, 500), 100, TimeUnit.MILLISECONDS));
        lbr.move(toStart);
        Report.line(getApplicationData(), "Motions " + (isTurned && getContext() == kuka_Sunrise_Cabinet_1.getContext()));
        Report.joints(getApplicationData(), "Motions", lbr);
    }

    public static void main(String[] args) {
        new Motions().runApplication();
    }
}
