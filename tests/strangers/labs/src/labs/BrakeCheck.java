package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest.BrakeTestResult;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.BrakeTest;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

/** A brake test, axis by axis, as the sample of every project. */
public class BrakeCheck extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    @Override
    public void run() throws Exception {
        lbr.move(ptp(0.1, 0.4, 0, -1.2, 0, 0.8, 0).setJointVelocityRel(0.5));
        int passed = 0;
        for (int axis = 0; axis < 2; axis++) {
            IMotionContainer tested = lbr.move(new BrakeTest(axis, 30.0));
            passed += tested.hasError() ? 0 : 1;
        }
        Report.line(getApplicationData(), "BrakeCheck " + (passed == 2 && BrakeTestResult.class != null));
        Report.joints(getApplicationData(), "BrakeCheck", lbr);
    }

    @Override
    public void onApplicationStateChanged(RoboticsAPIApplicationState state) {
        if (state == RoboticsAPIApplicationState.MOTIONPAUSING || state == RoboticsAPIApplicationState.RESUMING) {
            getLogger().info("paused or resumed");
        }
        super.onApplicationStateChanged(state);
    }
}
