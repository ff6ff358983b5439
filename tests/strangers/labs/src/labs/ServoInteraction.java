package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.connectivity.motionModel.directServo.DirectServo;
import com.kuka.connectivity.motionModel.directServo.IDirectServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.ISmartServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.connectivity.motionModel.smartServoLIN.ISmartServoLINRuntime;
import com.kuka.connectivity.motionModel.smartServoLIN.SmartServoLIN;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;

/** Follows a swing with each servo motion, compliant, and changes the stiffness on the way. */
public class ServoInteraction extends RoboticsAPIApplication {
    private static final int STEPS = 60;
    @Inject
    private LBR lbr;

    @Override
    public void run() throws Exception {
        JointPosition start = new JointPosition(0.1, 0.5, 0, -1.2, 0, 0.9, 0);
        lbr.move(ptp(start).setJointVelocityRel(0.5));
        boolean isValid = ServoMotion.validateForImpedanceMode(lbr);
        boolean isCompliant = smart(start);
        boolean isStraight = straight();
        lbr.move(ptp(start).setJointVelocityRel(0.5));
        boolean isDirect = direct(start);
        lbr.move(ptp(start).setJointVelocityRel(0.5));
        Report.line(getApplicationData(), "ServoInteraction " + isValid + " " + isCompliant + " " + isStraight + " " + isDirect);
        Report.joints(getApplicationData(), "ServoInteraction", lbr);
    }

    private boolean smart(JointPosition start) {
        CartesianImpedanceControlMode mode = new CartesianImpedanceControlMode();
        mode.parametrize(CartDOF.TRANSL).setStiffness(3000);
        mode.parametrize(CartDOF.ROT).setStiffness(200);
        mode.setNullSpaceStiffness(100);
        SmartServo motion = new SmartServo(lbr.getCurrentJointPosition());
        motion.setMinimumTrajectoryExecutionTime(20e-3);
        motion.setTimeoutAfterGoalReach(300);
        motion.setJointVelocityRel(0.5).setJointAccelerationRel(0.5);
        lbr.getFlange().moveAsync(motion.setMode(mode));
        ISmartServoRuntime runtime = motion.getRuntime();
        runtime.activateVelocityPlanning(true);
        for (int step = 0; step < STEPS; step++) {
            ThreadUtil.milliSleep(20);
            runtime.updateWithRealtimeSystem();
            JointPosition target = new JointPosition(start);
            target.set(6, 0.2 * Math.sin(Math.PI * step / STEPS));
            runtime.setDestination(target);
            if (step == STEPS / 2) {
                mode.parametrize(CartDOF.Z).setStiffness(1500);
                runtime.changeControlModeSettings(mode);
            }
        }
        runtime.setDestination(start);
        ThreadUtil.milliSleep(800);
        runtime.updateWithRealtimeSystem();
        boolean isThere = runtime.isDestinationReached() && runtime.getAxisQMsrOnController().isNearlyEqual(start, 0.02);
        getLogger().info(runtime.getFineIpoState() + ", " + runtime);
        return runtime.stopMotion() && isThere;
    }

    private boolean straight() {
        Frame start = lbr.getCurrentCartesianPosition(lbr.getFlange());
        SmartServoLIN motion = new SmartServoLIN(start);
        motion.setMaxTranslationVelocity(new double[] { 200, 200, 200 });
        motion.setMinimumTrajectoryExecutionTime(20e-3);
        lbr.getFlange().moveAsync(motion.setMode(new CartesianImpedanceControlMode()));
        ISmartServoLINRuntime runtime = motion.getRuntime();
        for (int step = 1; step <= STEPS; step++) {
            ThreadUtil.milliSleep(20);
            runtime.updateWithRealtimeSystem();
            runtime.setDestination(start.copyWithRedundancy().setZ(start.getZ() - 40.0 * step / STEPS));
        }
        ThreadUtil.milliSleep(800);
        runtime.updateWithRealtimeSystem();
        double depth = start.getZ() - runtime.getCurrentCartesianDestination(lbr.getFlange()).getZ();
        runtime.stopMotion();
        return Math.abs(depth - 40.0) < 0.1;
    }

    private boolean direct(JointPosition start) {
        JointImpedanceControlMode mode = new JointImpedanceControlMode(800, 800, 800, 800, 800, 800, 800);
        DirectServo motion = new DirectServo(lbr.getCurrentJointPosition());
        motion.setMinimumTrajectoryExecutionTime(40e-3);
        motion.setJointVelocityRel(0.5);
        lbr.moveAsync(motion.setMode(mode));
        IDirectServoRuntime runtime = motion.getRuntime();
        for (int step = 0; step <= STEPS; step++) {
            ThreadUtil.milliSleep(10);
            JointPosition target = new JointPosition(start);
            target.set(6, 0.1 * Math.sin(Math.PI * step / STEPS));
            runtime.setDestination(target);
            runtime.updateWithRealtimeSystem();
        }
        ThreadUtil.milliSleep(500);
        boolean isThere = lbr.getCurrentJointPosition().isNearlyEqual(start, 0.02);
        runtime.changeControlModeSettings(mode);
        return runtime.stopMotion() && isThere;
    }
}
