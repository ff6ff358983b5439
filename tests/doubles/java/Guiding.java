package sample;

import static com.kuka.roboticsAPI.motionModel.HRCMotions.handGuiding;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState.EnablingDeviceState;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.motionModel.HandGuidingMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.MMCMotions;

/** Hand guiding as Sunrise programmers write it; each step leaves a line that the test reads. */
public class Guiding extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    private PrintWriter out;

    @Override
    public void initialize() {
        try {
            String file = getApplicationData().getProcessData("sample.file").getValue();
            out = new PrintWriter(file, "UTF-8");
        } catch (java.io.IOException e) {
            throw new IllegalStateException(e);
        }
    }

    @Override
    public void run() {
        JointPosition before = lbr.getCurrentJointPosition();
        HandGuidingMotion motion = handGuiding().setJointLimitsEnabled(true, false, false, false, false, false, false)
                .setJointLimitsMin(-0.2, -1, -1, -1, -1, -1, -1).setJointLimitsMax(0.2, 1, 1, 1, 1, 1, 1)
                .setJointLimitViolationFreezesAll(false).setPermanentPullOnViolationAtStart(false)
                .setJointVelocityLimit(1.0).setCartVelocityLimit(400);
        IMotionContainer led = lbr.move(motion);
        say("it ends when the switch is let go", led.getState() == ExecutionState.Finished && !led.hasError());
        double most = 0.0;
        JointPosition after = lbr.getCurrentJointPosition();
        for (int i = 0; i < 7; i++) {
            most = Math.max(most, Math.abs(after.get(i) - before.get(i)));
        }
        say("the arm was led", most > 0.05);
        say("within its limits", Math.abs(after.get(0)) < 0.2);
        say("the switch is not held any more", device() == EnablingDeviceState.NONE);
        lbr.move(ptp(0, 0.5, 0, -1.3, 0, 0.9, 0));

        IMotionContainer waiting = lbr.moveAsync(MMCMotions.handGuiding().setAxisLimitsEnabled(new boolean[7])
                .setAxisLimitsMin(new double[7]).setAxisLimitsMax(new double[7]).setAxisLimitViolationFreezesAll(true));
        ThreadUtil.milliSleep(300);
        say("it waits for the switch", !waiting.isFinished() && Math.abs(lbr.getCurrentJointPosition().get(1) - 0.5) < 1e-3);
        waiting.cancel();
        waiting.await();
        say("and can be cancelled", waiting.getState() == ExecutionState.Cancelled);

        while (device() != EnablingDeviceState.HANDGUIDING) {
            ThreadUtil.milliSleep(20);
        }
        IMotionContainer again = lbr.moveAsync(new HandGuidingMotion());
        lbr.moveAsync(ptp(0, 0.4, 0, -1.3, 0, 0.9, 0)).await();
        say("what is behind it follows", again.isFinished() && Math.abs(lbr.getCurrentJointPosition().get(1) - 0.4) < 1e-3);

        int refused = 0;
        Runnable[] wrong = {
            () -> handGuiding().setJointLimitsMax(1, 2, 3), () -> handGuiding().setJointLimitsMin(new double[8]),
            () -> handGuiding().setJointLimitsEnabled(true), () -> handGuiding().setJointVelocityLimit(0),
            () -> handGuiding().setCartVelocityLimit(Double.NaN), () -> handGuiding().setJointLimitsMin(0, 0, 0, 0, 0, 0, Double.NaN),
            () -> lbr.moveAsync(handGuiding().setJointLimitsEnabled(true, true, true, true, true, true, true)
                    .setJointLimitsMin(1, 1, 1, 1, 1, 1, 1).setJointLimitsMax(0, 0, 0, 0, 0, 0, 0)),
        };
        for (Runnable one : wrong) {
            try {
                one.run();
            } catch (IllegalArgumentException e) {
                refused++;
            }
        }
        say("values that make no sense are refused", refused == wrong.length);
    }

    private EnablingDeviceState device() {
        return lbr.getSafetyState().getEnablingDeviceState();
    }

    private void say(String what, boolean holds) {
        out.println(what + " = " + holds);
        out.flush();
    }

    @Override
    public void dispose() {
        out.close();
        super.dispose();
    }
}
