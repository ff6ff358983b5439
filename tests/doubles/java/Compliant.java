package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.connectivity.motionModel.smartServo.ISmartServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.geometricModel.CartPlane;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode.CartImpBuilder;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianSineImpedanceControlMode;

/** Cartesian impedance as Sunrise programmers write it; each step leaves a line that the test reads. */
public class Compliant extends RoboticsAPIApplication {
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
    public void run() throws Exception {
        values();
        ranges();
        forces();
        patterns();
        limits();
        servo();
    }

    // ------------------------------------------------------------------------------ values

    private void values() {
        CartesianImpedanceControlMode mode = new CartesianImpedanceControlMode();
        say("it has Sunrise's defaults", mode.getStiffness()[0] == 2000 && mode.getStiffness()[5] == 200
                && mode.getDamping()[3] == 0.7 && !mode.hasMaxControlForceStopCondition());
        CartImpBuilder some = mode.parametrize(CartDOF.TRANSL);
        some.setStiffness(300).setDamping(0.5);
        mode.parametrize(CartDOF.A, CartDOF.C).setStiffness(50);
        mode.parametrize(CartDOF.ALL).setDamping(0.9);
        double[] stiffness = mode.getStiffness();
        say("directions are set by name and by group", stiffness[0] == 300 && stiffness[2] == 300 && stiffness[3] == 50
                && stiffness[4] == 200 && stiffness[5] == 50 && mode.getDamping()[0] == 0.9 && mode.getDamping()[4] == 0.9);
        mode.setNullSpaceStiffness(20);
        mode.setNullSpaceDamping(0.4);
        mode.setMaxControlForce(10, 20, 30, 1, 2, 3, true);
        mode.setMaxCartesianVelocity(100, 200, 300, 1, 2, 3);
        mode.setMaxPathDeviation(11, 22, 33, 0.1, 0.2, 0.3);
        CartesianImpedanceControlMode copy = new CartesianImpedanceControlMode(mode);
        mode.parametrize(CartDOF.X).setStiffness(1);
        say("a copy is one of its own", copy.getStiffness()[0] == 300 && copy.getMaxControlForce()[2] == 30
                && copy.getMaxCartesianVelocity()[1] == 200 && copy.getMaxPathDeviation()[3] == 0.1
                && copy.hasMaxControlForceStopCondition() && copy.getNullSpaceStiffness() == 20
                && copy.getNullSpaceDamping() == 0.4);
        CartesianSineImpedanceControlMode wave = CartesianSineImpedanceControlMode.createSinePattern(CartDOF.Y, 2, 5, 700);
        CartesianImpedanceControlMode seenAsSpring = wave;
        say("a pattern is a Cartesian impedance too", seenAsSpring.getStiffness()[1] == 700
                && new CartesianSineImpedanceControlMode(wave).getStiffness()[1] == 700);
    }

    private void ranges() {
        final CartesianImpedanceControlMode mode = new CartesianImpedanceControlMode();
        final CartesianSineImpedanceControlMode wave = new CartesianSineImpedanceControlMode();
        Runnable[] wrong = {
            () -> mode.parametrize(CartDOF.X).setStiffness(5001), () -> mode.parametrize(CartDOF.B).setStiffness(301),
            () -> mode.parametrize(CartDOF.ALL).setStiffness(400), () -> mode.parametrize(CartDOF.X).setStiffness(-1),
            () -> mode.parametrize(CartDOF.X).setDamping(0.05), () -> mode.parametrize(CartDOF.X).setDamping(1.1),
            () -> mode.parametrize(CartDOF.X).setAdditionalControlForce(Double.NaN), () -> mode.parametrize(),
            () -> mode.setNullSpaceStiffness(-1), () -> mode.setNullSpaceDamping(0.2),
            () -> mode.setMaxControlForce(-1, 0, 0, 0, 0, 0, false), () -> mode.setMaxPathDeviation(0, 1, 1, 1, 1, 1),
            () -> mode.setMaxCartesianVelocity(1, 1, 1, 1, 1, Double.NaN),
            () -> wave.parametrize(CartDOF.X).setAmplitude(-1), () -> wave.parametrize(CartDOF.X).setFrequency(15.1),
            () -> wave.parametrize(CartDOF.X).setPhaseDeg(-1), () -> wave.parametrize(CartDOF.X).setForceLimit(-1),
            () -> wave.parametrize(CartDOF.X).setPositionLimit(-1), () -> wave.setTotalTime(-1), () -> wave.setRiseTime(-1),
            () -> wave.setHoldTime(-1), () -> wave.setFallTime(Double.NaN),
            () -> CartesianSineImpedanceControlMode.createDesiredForce(CartDOF.A, 1, 500),
            () -> CartesianSineImpedanceControlMode.createLissajousPattern(CartPlane.XY, 20, 1, 500),
        };
        int refused = 0;
        for (Runnable one : wrong) {
            try {
                one.run();
            } catch (IllegalArgumentException e) {
                refused++;
            }
        }
        say("values out of range are refused", refused == wrong.length);
        say("and change nothing", mode.getStiffness()[0] == 2000 && mode.getMaxPathDeviation()[1] > 1000);
    }

    // ------------------------------------------------------------------------------ on the arm

    private Frame home() {
        lbr.move(ptp(0, 0.5, 0, -1.3, 0, 0.9, 0));
        return lbr.getCurrentCartesianPosition(lbr.getFlange());
    }

    /** Where the flange is, seen from where it was. */
    private Transformation from(Frame before) {
        return before.transformationTo(lbr.getCurrentCartesianPosition(lbr.getFlange()));
    }

    private static boolean near(double value, double wanted, double tolerance) {
        return Math.abs(value - wanted) <= tolerance;
    }

    private void forces() {
        CartesianImpedanceControlMode compliant = new CartesianImpedanceControlMode();
        compliant.parametrize(CartDOF.TRANSL).setStiffness(500);
        compliant.parametrize(CartDOF.A).setStiffness(40);
        Frame before = home();
        compliant.setAdditionalControlForce(0, 10, 15, 0, 0, 0);
        lbr.move(positionHold(compliant, 1000, TimeUnit.MILLISECONDS));
        Transformation travel = from(before);
        say("a force moves the flange by force over stiffness, along its own axes",
                near(travel.getX(), 0, 0.5) && near(travel.getY(), 20, 0.5) && near(travel.getZ(), 30, 0.6));
        before = home();
        compliant.setAdditionalControlForce(0, 0, 0, 4, 0, 0);
        lbr.move(positionHold(compliant, 1000, TimeUnit.MILLISECONDS));
        travel = from(before);
        say("a torque in A turns it about z", near(travel.getAlphaRad(), 0.1, 2e-3) && near(travel.getGammaRad(), 0, 2e-3));
        before = home();
        compliant.setAdditionalControlForce(0, 0, 0, 0, 0, 0);
        compliant.parametrize(CartDOF.Z).setAdditionalControlForce(-10);
        compliant.setReferenceSystem(lbr.getRootFrame());
        lbr.move(positionHold(compliant, 1000, TimeUnit.MILLISECONDS));
        Frame after = lbr.getCurrentCartesianPosition(lbr.getFlange());
        say("with a reference system along that one's axes",
                near(after.getX() - before.getX(), 0, 0.5) && near(after.getZ() - before.getZ(), -20, 0.5));
        before = home();
        CartesianImpedanceControlMode free = new CartesianImpedanceControlMode();
        lbr.move(linRel(0, 60, 0).setCartVelocity(100).setMode(free));
        say("a LIN under Cartesian impedance arrives", near(from(before).getY(), 60, 1.0));
    }

    private void patterns() {
        Frame before = home();
        lbr.move(positionHold(CartesianSineImpedanceControlMode.createDesiredForce(CartDOF.Y, -8, 400), 1000, TimeUnit.MILLISECONDS));
        say("a desired force", near(from(before).getY(), -20, 0.5));
        before = home();
        CartesianSineImpedanceControlMode wave = CartesianSineImpedanceControlMode.createSinePattern(CartDOF.X, 0.7, 40, 2000);
        IMotionContainer swinging = lbr.moveAsync(positionHold(wave, -1, null));
        ThreadUtil.milliSleep(300);
        double[] x = extremes(before, 1500, true);
        say("a sine swings by its amplitude", near(x[0], -20, 2) && near(x[1], 20, 2));
        swinging.cancel();
        swinging.await();
        before = home();
        wave.parametrize(CartDOF.X).setBias(24).setForceLimit(32).setPhaseDeg(90);
        swinging = lbr.moveAsync(positionHold(wave, -1, null));
        ThreadUtil.milliSleep(500);
        x = extremes(before, 1500, true);
        say("about its bias, up to the force limit", near(x[0], -8, 2) && near(x[1], 16, 2));
        swinging.cancel();
        swinging.await();
        before = home();
        CartesianSineImpedanceControlMode spiral = CartesianSineImpedanceControlMode.createSpiralPattern(CartPlane.XY, 1, 40, 2000, 3);
        spiral.setStayActiveUntilPatternFinished(true);
        swinging = lbr.moveAsync(positionHold(spiral, 100, TimeUnit.MILLISECONDS));
        ThreadUtil.milliSleep(400);
        say("a spiral holds its motion open", !swinging.isFinished());
        x = extremes(before, 1500, true);
        say("it goes round", x[0] < -10 && x[1] > 10);
        swinging.await();
        say("and returns", !swinging.hasError() && near(from(before).getX(), 0, 1.5) && near(from(before).getY(), 0, 1.5));
        before = home();
        swinging = lbr.moveAsync(positionHold(CartesianSineImpedanceControlMode.createLissajousPattern(CartPlane.YZ, 1, 32, 2000), -1, null));
        x = extremes(before, 1000, false);
        say("a Lissajous figure in its plane", x[0] < -8 && x[1] > 8 && near(from(before).getX(), 0, 1.5));
        swinging.cancel();
        swinging.await();
    }

    /** Least and largest x (or y) for a time, seen from where the flange was [mm]. */
    private double[] extremes(Frame before, int millis, boolean alongX) {
        double[] seen = {0, 0};
        for (int i = 0; i < millis / 20; i++) {
            Transformation now = from(before);
            double value = alongX ? now.getX() : now.getY();
            seen[0] = Math.min(seen[0], value);
            seen[1] = Math.max(seen[1], value);
            ThreadUtil.milliSleep(20);
        }
        return seen;
    }

    private void limits() {
        CartesianImpedanceControlMode narrow = new CartesianImpedanceControlMode();
        narrow.parametrize(CartDOF.TRANSL).setStiffness(300);
        narrow.setAdditionalControlForce(0, 20, 0, 0, 0, 0);
        narrow.setMaxPathDeviation(10, 10, 10, 1, 1, 1);
        say("a path deviation ends the motion", fails(narrow, "Maximum path deviation exceeded"));
        CartesianImpedanceControlMode slow = new CartesianImpedanceControlMode();
        slow.setAdditionalControlForce(0, 60, 0, 0, 0, 0);
        slow.setMaxCartesianVelocity(20, 20, 20, 1, 1, 1);
        say("a velocity ends the motion", fails(slow, "Maximum Cartesian velocity exceeded"));
        CartesianImpedanceControlMode weak = new CartesianImpedanceControlMode();
        weak.setAdditionalControlForce(0, 60, 0, 0, 0, 0);
        weak.setMaxControlForce(15, 15, 15, 5, 5, 5, true);
        say("a control force ends the motion", fails(weak, "Maximum control force exceeded"));
        weak.setMaxControlForce(15, 15, 15, 5, 5, 5, false);
        Frame before = home();
        lbr.move(positionHold(weak, 1000, TimeUnit.MILLISECONDS));
        say("without the stop condition it is only limited", near(from(before).getY(), 30, 0.6));
        CartesianSineImpedanceControlMode endless = new CartesianSineImpedanceControlMode();
        endless.setStayActiveUntilPatternFinished(true);
        say("a pattern without an end cannot be waited for", fails(endless, "without an end"));
    }

    private boolean fails(CartesianImpedanceControlMode mode, String text) {
        home();
        try {
            lbr.move(positionHold(mode, 3000, TimeUnit.MILLISECONDS));
            return false;
        } catch (CommandInvalidException e) {
            return e.getMessage().contains(text);
        }
    }

    private void servo() {
        Frame before = home();
        CartesianImpedanceControlMode compliant = new CartesianImpedanceControlMode();
        SmartServo motion = new SmartServo(lbr.getCurrentJointPosition());
        motion.setMode(compliant);
        lbr.moveAsync(motion);
        ISmartServoRuntime runtime = motion.getRuntime();
        compliant.parametrize(CartDOF.Z).setAdditionalControlForce(20);
        runtime.changeControlModeSettings(compliant);
        ThreadUtil.milliSleep(1000);
        say("a servo motion takes other settings", near(from(before).getZ(), 10, 0.3));
        compliant.parametrize(CartDOF.Z).setStiffness(1000);
        runtime.changeControlModeSettings(compliant);
        ThreadUtil.milliSleep(1200);
        say("again and again", near(from(before).getZ(), 20, 0.5));
        boolean kept = false;
        try {
            runtime.changeControlModeSettings(new CartesianSineImpedanceControlMode());
        } catch (CommandInvalidException e) {
            kept = true;
        }
        say("but no other kind", kept);
        runtime.stopMotion();
    }

    private void say(String what, boolean truth) {
        out.println(what + " = " + truth);
        out.flush();
    }

    @Override
    public void dispose() {
        out.close();
        super.dispose();
    }
}
