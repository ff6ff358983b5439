package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptpHome;

import java.io.PrintWriter;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.connectivity.motionModel.directServo.DirectServo;
import com.kuka.connectivity.motionModel.directServo.IDirectServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.IServoOnGoalReachedEvent;
import com.kuka.connectivity.motionModel.smartServo.IServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.ISmartServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.connectivity.motionModel.smartServoLIN.ISmartServoLINRuntime;
import com.kuka.connectivity.motionModel.smartServoLIN.SmartServoLIN;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;

/** Servo motions as Sunrise programmers write them; each step leaves a line that the test reads. */
public class Serving extends RoboticsAPIApplication implements IServoOnGoalReachedEvent {
    @Inject
    private LBR lbr;

    private volatile int reached;
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
        lbr.move(ptpHome());
        say("home is the stretched arm", isAt(new JointPosition(7)));
        lbr.setHomePosition(new JointPosition(0, 0.5, 0, -1.3, 0, 0.9, 0));
        lbr.move(ptpHome().setJointVelocityRel(0.8));
        say("or what was set", isAt(new JointPosition(0, 0.5, 0, -1.3, 0, 0.9, 0)));
        smart();
        direct();
        straight();
        timeout();
        impedance();
    }

    private JointPosition beside(JointPosition here, double a7) {
        JointPosition there = new JointPosition(here);
        there.set(6, here.get(6) + a7);
        return there;
    }

    private boolean isAt(JointPosition there) {
        return lbr.getCurrentJointPosition().isNearlyEqual(there, 1e-3);
    }

    private void smart() {
        JointPosition here = lbr.getCurrentJointPosition();
        SmartServo motion = new SmartServo(here);
        boolean before = false;
        try {
            motion.getRuntime();
        } catch (IllegalStateException e) {
            before = true;
        }
        say("no runtime before the motion is commanded", before);
        motion.useTrace(true);
        motion.setMinimumTrajectoryExecutionTime(5e-3);
        motion.setTimeoutAfterGoalReach(3600);
        motion.setJointVelocityRel(0.5).setJointAccelerationRel(0.5);
        lbr.moveAsync(motion);
        ISmartServoRuntime runtime = motion.getRuntime();
        runtime.setGoalReachedEventHandler(this);
        JointPosition there = beside(here, 0.3);
        for (int i = 1; i <= 50; i++) {
            runtime.updateWithRealtimeSystem();
            runtime.setDestination(beside(here, 0.3 * i / 50));
            ThreadUtil.milliSleep(10);
        }
        ThreadUtil.milliSleep(600);
        runtime.updateWithRealtimeSystem();
        ThreadUtil.milliSleep(50);
        say("SmartServo arrives", isAt(there) && runtime.isDestinationReached());
        say("the goal is reported", reached == 50);
        say("the destination can be read back", runtime.getCurrentJointDestination().isNearlyEqual(there, 1e-9));
        runtime.setDestination(there, new JointPosition(0, 0, 0, 0, 0, 0, 0.2));
        ThreadUtil.milliSleep(700);
        say("a velocity moves it a little further, then the arm rests", lbr.getCurrentJointPosition().get(6) > there.get(6) + 5e-3);
        Frame pose = lbr.getCurrentCartesianPosition(lbr.getFlange());
        pose.setY(pose.getY() + 50);
        runtime.setDestination(pose);
        ThreadUtil.milliSleep(1500);
        say("a Cartesian destination", Math.abs(lbr.getCurrentCartesianPosition(lbr.getFlange()).getY() - pose.getY()) < 0.5);
        say("out of reach", refuses(runtime, new Frame(5000, 0, 0)));
        say("behind a limit", refuses(runtime, beside(here, 9)));
        say("stopMotion", runtime.stopMotion());
        ThreadUtil.milliSleep(500);
        say("after its end it takes no destinations", refuses(runtime, here));
    }

    private boolean refuses(ISmartServoRuntime runtime, Object destination) {
        try {
            if (destination instanceof Frame) {
                runtime.setDestination((Frame) destination);
            } else {
                runtime.setDestination((JointPosition) destination);
            }
            return false;
        } catch (IllegalStateException e) { // of a destination
            return true;
        } catch (CommandInvalidException e) { // of a motion that has ended
            return true;
        }
    }

    private void direct() {
        JointPosition here = lbr.getCurrentJointPosition();
        DirectServo motion = new DirectServo(here).setMinimumTrajectoryExecutionTime(40e-3);
        lbr.getFlange();
        lbr.moveAsync(motion);
        IDirectServoRuntime runtime = motion.getRuntime(true);
        for (int i = 1; i <= 100; i++) {
            runtime.setDestination(beside(here, 0.2 * i / 100));
            ThreadUtil.milliSleep(5);
        }
        ThreadUtil.milliSleep(300);
        say("DirectServo reports its joints", runtime.getAxisQMsrOnController().isNearlyEqual(beside(here, 0.2), 1e-3));
        runtime.setDestination(lbr.getCurrentCartesianPosition(lbr.getFlange()), lbr.getRootFrame());
        ThreadUtil.milliSleep(50);
        say("DirectServo arrives", isAt(beside(here, 0.2)));
        runtime.stopMotion();
        ThreadUtil.milliSleep(300);
    }

    private void straight() {
        lbr.move(ptp(0, 0.5, 0, -1.3, 0, 0.9, 0));
        Frame start = lbr.getCurrentCartesianPosition(lbr.getFlange());
        SmartServoLIN motion = new SmartServoLIN(start);
        say("limits that are none are refused", refuses(motion, new double[] {100, 100}) && refuses(motion, new double[] {100, 0, 100}));
        motion.setMaxTranslationVelocity(new double[] {100, 100, 100}).setMaxTranslationAcceleration(new double[] {1000, 1000, 1000});
        motion.setMaxOrientationVelocity(new double[] {0.5, 0.5, 0.5}).setMaxOrientationAcceleration(new double[] {2, 2, 2});
        motion.setReferenceFrame(lbr.getRootFrame()).setMaxNullSpaceVelocity(0.5).setMaxNullSpaceAcceleration(1.0);
        motion.setTimeoutAfterGoalReach(60.0);
        lbr.moveAsync(motion);
        ISmartServoLINRuntime runtime = motion.getRuntime(true);
        runtime.setGoalReachedEventHandler(this);
        reached = 0;
        Frame there = new Frame(start.getX() - 20, start.getY() + 60, start.getZ() - 40, start.getAlphaRad() + 0.2, start.getBetaRad(),
                start.getGammaRad());
        runtime.setDestination(there);
        double aside = 0;
        for (int i = 0; i < 150; i++) {
            ThreadUtil.milliSleep(10);
            Frame here = lbr.getCurrentCartesianPosition(lbr.getFlange());
            double fraction = (here.getY() - start.getY()) / 60;
            aside = Math.max(aside, Math.abs(here.getX() - start.getX() + 20 * fraction));
            aside = Math.max(aside, Math.abs(here.getZ() - start.getZ() + 40 * fraction));
        }
        for (int i = 0; i < 300 && reached == 0; i++) { // reported without an update, by a thread of the cabinet
            ThreadUtil.milliSleep(10);
        }
        Frame here = lbr.getCurrentCartesianPosition(lbr.getFlange());
        say("SmartServoLIN arrives", here.distanceTo(there) < 0.5 && Math.abs(here.getAlphaRad() - there.getAlphaRad()) < 1e-3);
        say("on a straight line", aside < 1.0);
        say("its goal is reported, too", runtime.isDestinationReached() && reached == 1);
        say("and can be read back", runtime.getCurrentCartesianDestination(lbr.getFlange()).distanceTo(there) < 1e-3);
        boolean refused = false;
        try {
            runtime.setDestination(new Frame(5000, 0, 0));
        } catch (IllegalStateException e) {
            refused = true;
        }
        say("out of its reach", refused);
        say("it stops", runtime.stopMotion());
        ThreadUtil.milliSleep(300);
    }

    private boolean refuses(SmartServoLIN motion, double[] limits) {
        try {
            motion.setMaxTranslationVelocity(limits);
            return false;
        } catch (IllegalArgumentException e) {
            return true;
        }
    }

    private void timeout() {
        SmartServo motion = new SmartServo(lbr.getCurrentJointPosition());
        motion.setTimeoutAfterGoalReach(200, TimeUnit.MILLISECONDS);
        lbr.moveAsync(motion);
        ISmartServoRuntime runtime = motion.getRuntime();
        ThreadUtil.milliSleep(1500);
        say("a servo motion without destinations times out", refuses(runtime, lbr.getCurrentJointPosition()));
    }

    private void impedance() {
        say("impedance control may begin", ServoMotion.validateForImpedanceMode(lbr));
        JointImpedanceControlMode compliant = new JointImpedanceControlMode(300, 300, 300, 300, 300, 300, 300);
        compliant.setDampingForAllJoints(0.7);
        JointPosition here = lbr.getCurrentJointPosition();
        SmartServo motion = new SmartServo(here);
        motion.setMode(compliant);
        lbr.moveAsync(motion);
        IServoRuntime runtime = motion.getRuntime();
        motion.getRuntime().setDestination(beside(here, 0.1));
        compliant.setStiffnessForAllJoints(100);
        runtime.changeControlModeSettings(compliant);
        ThreadUtil.milliSleep(1500);
        say("it follows with compliance", lbr.getCurrentJointPosition().isNearlyEqual(beside(here, 0.1), 5e-3));
        boolean kept = false;
        try {
            runtime.changeControlModeSettings(new PositionControlMode());
        } catch (CommandInvalidException e) {
            kept = true;
        }
        say("the kind of the mode cannot change", kept);
        runtime.stopMotion();
    }

    @Override
    public void onGoalReachedEvent(String state, double[] currentAxisPos, int[] osTimestamp, int targetId) {
        reached = targetId;
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
