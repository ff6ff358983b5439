package sample;

import java.io.PrintWriter;
import java.util.Arrays;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.app.CabinetArm;
import heptarm.core.CommandRejected;
import heptarm.core.api.Arm;
import heptarm.core.api.Impedance;
import heptarm.core.api.MotionHandle;
import heptarm.core.api.Move;
import heptarm.core.api.ServoHandle;
import heptarm.core.api.StopCondition;
import heptarm.wire.Axis;
import heptarm.wire.CartesianImpedance;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.FrameInfo;
import heptarm.wire.MotionFinished;
import heptarm.wire.OrientationReference;
import heptarm.wire.OrientationType;
import heptarm.wire.Pose;
import heptarm.wire.SafetyBits;
import heptarm.wire.SetSignal;
import heptarm.wire.Shape;
import heptarm.wire.ToolInfo;

/** An application on heptarm's core without any network; each step leaves a line that the test reads. */
public class Alone extends RoboticsAPIApplication {
    private static final Move HOME = Move.ptp(0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0);
    private static final ToolInfo GRIPPER = new ToolInfo("gripper", 1.0, new double[] {0, 0, 0.05}, new double[6],
            new FrameInfo[] {new FrameInfo("tip", Move.pose(0, 0, 0.12)), new FrameInfo("camera", Move.pose(0.05, 0, 0.03))}, new Shape[0]);
    private static final ToolInfo PIECE = new ToolInfo("piece", 0.5, new double[3], new double[6], new FrameInfo[0], new Shape[0]);

    @Inject
    private LBR lbr;
    private Arm arm;
    private PrintWriter out;

    @Override
    public void initialize() {
        try {
            String file = getApplicationData().getProcessData("sample.file").getValue();
            out = new PrintWriter(file, "UTF-8");
        } catch (java.io.IOException e) {
            throw new IllegalStateException(e);
        }
        arm = CabinetArm.of(lbr, this);
    }

    private interface Attempt {
        void make() throws CommandRejected, InterruptedException;
    }

    private static int code(Attempt attempt) throws InterruptedException {
        try {
            attempt.make();
            return 0;
        } catch (CommandRejected e) {
            return e.code;
        }
    }

    @Override
    public void run() throws Exception {
        arm.move(HOME);
        motions();
        conditions();
        modes();
        servo();
        tools();
        signals();
        recovery();
    }

    private Pose here() {
        return new Pose(arm.pose().xyz, arm.pose().quat);
    }

    private void motions() throws Exception {
        Pose start = here();
        Pose over = new Pose(new double[] {start.xyz[0], start.xyz[1] + 0.05, start.xyz[2] + 0.03}, start.quat);
        Move line = Move.lin(over).cartesian(0.2, 1.0, 10.0).rotational(0.5, 2.0, 20.0).jerk(0.5)
                .orientation(OrientationType.CONSTANT, OrientationReference.BASE);
        say("a batch is blended", arm.move(line.blending(0.0, 0.02, 0.0), Move.lin(start)).cause == Cause.FINISHED);
        Move slow = HOME.speed(1, 1, 1, 1, 1, 1, 0.05);
        double[] turned = {0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.1};
        arm.move(Move.ptp(turned));
        say("an axis has a speed of its own", arm.move(slow).duration > 0.8); // A7: 0.1 rad with 5 % of 2.36 rad/s
        say("a joint spline", arm.move(Move.splineJoints(Move.ptp(turned), Move.ptp(0.05, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0), HOME)).cause
                == Cause.FINISHED);
        say("a value that is none is refused", code(() -> arm.move(HOME.speed(1.5))) == Code.OUT_OF_RANGE);
        boolean refused = false;
        try {
            Move.spline(HOME);
        } catch (IllegalArgumentException e) {
            refused = true;
        }
        say("a spline takes no ptp", refused);
    }

    private void conditions() throws Exception {
        Move down = Move.linRel(0.0, 0.0, 0.15).velocity(0.1);
        MotionFinished end = arm.move(down.until(StopCondition.pathFromStart(0.03).and(StopCondition.force(1000.0).not())));
        say("and, not", end.cause == Cause.CONDITION && end.fired == 3);
        end = arm.move(down.until(StopCondition.jointTorque(4, -500, 500).or(StopCondition.torque(Axis.X, -900, 900)).or(StopCondition.pathToEnd(0.1))));
        say("the leaf that fires is named", end.cause == Cause.CONDITION && end.fired == 3);
        arm.write("MediaFlange.LEDBlue", 0);
        end = arm.move(down.trigger(StopCondition.pathFromStart(0.02), new SetSignal("MediaFlange.LEDBlue", 1)).until(StopCondition.pathFromStart(0.06)));
        say("a trigger on the way switches a lamp", end.cause == Cause.CONDITION && arm.read("MediaFlange.LEDBlue") == 1.0);
        arm.write("MediaFlange.LEDBlue", 0);
        say("a signal that is none", code(() -> arm.move(down.until(StopCondition.signal("No.Such", true)))) == Code.UNKNOWN_NAME);
        arm.move(HOME);
    }

    private void modes() throws Exception {
        Impedance compliant = Impedance.cartesian(1000, 100).damping(0.9).nullSpace(20, 0.7).along("base");
        MotionHandle hold = arm.start(Move.hold(Double.NaN).mode(compliant.mode()));
        while (!(arm.mode() instanceof CartesianImpedance)) {
            Thread.sleep(5);
        }
        say("the mode is read back", ((CartesianImpedance) arm.mode()).damping[0] == 0.9);
        hold.cancel();
        hold.await();
        say("joints as springs", arm.move(Move.linRel(0, 0, -0.02).mode(Impedance.joints(800))).cause == Cause.FINISHED);
        double[] none = new double[6];
        double[] along = {5, 0, 0, 0, 0, 0};
        say("a pattern", arm.move(Move.hold(0.2).mode(compliant.sine(along, along, none))).cause == Cause.FINISHED);
        say("a stiffness that is none", code(() -> arm.move(HOME.mode(Impedance.cartesian(9000, 100).mode()))) == Code.OUT_OF_RANGE);
        arm.move(HOME);
    }

    private void servo() throws Exception {
        ServoHandle stream = arm.servo(0.3, 0.3, 2.0, Impedance.joints(900));
        double[] there = {0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.1};
        stream.followVelocity(there, new double[] {0, 0, 0, 0, 0, 0, 0.02});
        while (arm.joints()[6] < 0.09) {
            Thread.sleep(5);
        }
        stream.changeMode(Impedance.joints(500));
        say("its kind of mode stays", code(() -> stream.changeMode(Impedance.cartesian(1000, 100).mode())) == Code.MODE_CONFLICT);
        say("a stream ends at rest", stream.close().cause == Cause.CANCELLED);
    }

    private void tools() throws Exception {
        say("no tool is attached", Arrays.asList(arm.attached()).equals(Arrays.asList("", "", "flange", "")));
        say("one that nobody knows", code(() -> arm.attach("hammer")) == Code.UNKNOWN_NAME);
        arm.define(GRIPPER);
        double before = arm.pose().xyz[2];
        arm.attach("gripper");
        say("it is known and attached", arm.tools().length == 1 && "tip".equals(arm.attached()[2]));
        say("its frame is moved", Math.abs(arm.pose().xyz[2] - before) > 0.05);
        arm.load(PIECE);
        say("it holds a piece", "piece".equals(arm.attached()[1]));
        say("whose weight is no external load", Math.abs(arm.wrench("base").force[2]) < 1.0);
        say("a frame that nobody knows", code(() -> arm.wrench("moon")) == Code.UNKNOWN_NAME);
        say("it turns about its tip", turnsAboutTip());
        MotionHandle busy = arm.start(Move.hold(Double.NaN));
        say("nothing changes while the arm moves", code(() -> arm.detach()) == Code.BUSY);
        busy.cancel();
        busy.await();
        arm.unload(PIECE);
        arm.attach("gripper", "camera");
        say("another frame", "camera".equals(arm.attached()[2]));
        arm.detach();
        say("and off it is", "".equals(arm.attached()[0]));
    }

    private boolean turnsAboutTip() throws Exception {
        double[] place = arm.pose().xyz;
        arm.move(Move.linRel(new Pose(new double[3], new double[] {0, 0, Math.sin(0.1), Math.cos(0.1)})));
        double[] after = arm.pose().xyz;
        return Math.abs(place[0] - after[0]) + Math.abs(place[1] - after[1]) + Math.abs(place[2] - after[2]) < 1e-3;
    }

    private void signals() throws Exception {
        say("there are signals", arm.signals().length > 0);
        arm.write("MediaFlange.LEDRed", 1);
        say("an output is written and read", arm.read("MediaFlange.LEDRed") == 1.0);
        say("an input is not", code(() -> arm.write("MediaFlange.UserButton", 1)) == Code.UNSUPPORTED);
        say("a signal that nobody knows", code(() -> arm.read("No.Such")) == Code.UNKNOWN_NAME);
    }

    private void recovery() throws Exception {
        arm.setOverride(0.5);
        say("the override", arm.override() == 0.5);
        arm.setOverride(1.0);
        arm.recover();
        say("ready", (arm.safety().bits & SafetyBits.READY_TO_MOVE) != 0);
        say("what it can do", Arrays.asList(arm.capabilities()).contains("servo_lin") && arm.info().q_max.length == 7);
    }

    private void say(String what, boolean truth) {
        out.println(what + " = " + truth);
        out.flush();
    }

    @Override
    public void dispose() {
        try {
            arm.close();
        } finally {
            out.close();
            super.dispose();
        }
    }
}
