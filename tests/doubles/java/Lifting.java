package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState.SafetyStopType;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Inertia;
import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

/** Lifts a workpiece of 4 kg where safety functions stop an unknown one; then forgets in one of several ways to tell them. */
public class Lifting extends RoboticsAPIApplication {
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
        String forgotten = getApplicationData().getProcessData("sample.forgotten").getValue();
        Workpiece piece = weighing("piece", 4.0);
        lbr.setSafetyWorkpiece(null);
        lbr.move(ptp(0.0, 0.5, 0.0, -1.5, 0.0, 1.0, 0.0).setJointVelocityRel(0.5));
        piece.attachTo(lbr.getFlange());
        lbr.setSafetyWorkpiece(piece);
        lbr.move(linRel(0, 0, -40).setCartVelocity(200));
        say("a safety workpiece is lifted", !isStopped());
        try {
            lbr.setSafetyWorkpiece(weighing("anvil", 6.0));
            say("what is too heavy is refused", false);
        } catch (IllegalArgumentException e) {
            say("what is too heavy is refused", e.getMessage().contains("allows 5 kg"));
        }
        lbr.move(linRel(0, 0, 40).setCartVelocity(200));
        say("and the one before is still counted", !isStopped());
        if (forgotten.equals("to count")) {
            lbr.setSafetyWorkpiece(null);
        } else {
            piece.detach();
        }
        say("the stop comes with the motion", !isStopped());
        IMotionContainer motion = lbr.moveAsync(linRel(0, 0, -40).setCartVelocity(50));
        for (int i = 0; i < 200 && !isStopped(); i++) {
            ThreadUtil.milliSleep(20);
        }
        say("the arm is stopped", isStopped() && !motion.isFinished());
    }

    private static Workpiece weighing(String name, double mass) {
        return new Workpiece(name, new LoadData(mass, Transformation.ofTranslation(0, 0, 50), Inertia.of(0.01, 0.01, 0.01)));
    }

    private boolean isStopped() {
        return lbr.getSafetyState().getSafetyStopSignal() != SafetyStopType.NOSTOP;
    }

    private void say(String what, Object value) {
        out.println(what + " = " + value);
        out.flush();
    }
}
