package heptarm.samples;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.app.CabinetArm;
import heptarm.core.CommandRejected;
import heptarm.core.api.Arm;
import heptarm.core.api.MotionHandle;
import heptarm.core.api.Move;
import heptarm.core.api.StopCondition;
import heptarm.wire.Axis;
import heptarm.wire.MotionFinished;
import heptarm.wire.Pose;
import heptarm.wire.PoseState;

/** Visits places one after the other, blocking and not, along curves and until something is touched. Everything in SI. */
public class Visit extends RoboticsAPIApplication {
    private static final Move HOME = Move.ptp(0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0).speed(0.5);

    @Inject
    private LBR lbr;
    private Arm arm;

    @Override
    public void initialize() {
        arm = CabinetArm.of(lbr, this);
    }

    @Override
    public void run() throws Exception {
        arm.move(HOME);
        square();
        curve();
        interrupted();
        touched();
        refused();
    }

    /** Four motions as one program: the call returns when the last one has ended. */
    private void square() throws CommandRejected, InterruptedException {
        Move side = Move.linRel(0.1, 0.0, 0.0).along("base").velocity(0.2);
        MotionFinished end = arm.move(side, Move.linRel(0.0, 0.1, 0.0).along("base").velocity(0.2),
                Move.linRel(-0.1, 0.0, 0.0).along("base").velocity(0.2), Move.linRel(0.0, -0.1, 0.0).along("base").velocity(0.2));
        say("square", end.cause + " after " + Math.round(end.duration) + " s");
    }

    /** Three places that are passed without a stop, and back. */
    private void curve() throws CommandRejected, InterruptedException {
        PoseState here = arm.pose();
        Pose start = new Pose(here.xyz, here.quat);
        MotionFinished end = arm.move(Move.spline(Move.spl(beside(start, 0.04, 0.03)), Move.spl(beside(start, 0.08, 0.0)).velocity(0.1),
                Move.circ(beside(start, 0.04, -0.03), start)).velocity(0.2));
        say("curve", end.cause + " in " + arm.info().title);
    }

    private static Pose beside(Pose place, double y, double z) {
        return new Pose(new double[] {place.xyz[0], place.xyz[1] + y, place.xyz[2] + z}, place.quat);
    }

    /** A motion that ends at what it touches; here it ends at the largest distance. */
    private void touched() throws CommandRejected, InterruptedException {
        StopCondition touch = StopCondition.normalForce(Axis.Z, 15.0).or(StopCondition.signal("MediaFlange.UserButton", true)).or(StopCondition.pathFromStart(0.05));
        MotionFinished end = arm.move(Move.linRel(0.0, 0.0, -0.2).along("base").velocity(0.1).until(touch));
        say("touched", end.cause + " by condition " + end.fired);
        arm.move(Move.home().speed(0.5), HOME);
    }

    /** A motion that is watched while it runs, and cancelled half way. */
    private void interrupted() throws CommandRejected, InterruptedException {
        Pose before = new Pose(arm.pose().xyz, arm.pose().quat);
        MotionHandle down = arm.start(Move.linRel(0.0, 0.0, -0.2).along("base").velocity(0.1));
        while (!down.isFinished() && arm.pose().xyz[2] > before.xyz[2] - 0.1) {
            Thread.sleep(5);
        }
        down.cancel();
        say("interrupted", down.await().cause + " " + Math.round(100 * (before.xyz[2] - arm.pose().xyz[2])) + " cm below");
        arm.move(Move.lin(before).velocity(0.2));
    }

    /** What cannot be done is refused before anything moves. */
    private void refused() throws InterruptedException {
        try {
            arm.move(Move.ptp(0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0));
        } catch (CommandRejected e) {
            say("refused", e.parameter + ": " + e.getMessage());
        }
    }

    private void say(String what, String text) {
        getLogger().info(what + " = " + text);
    }

    @Override
    public void dispose() {
        try {
            if (arm != null) {
                arm.close();
            }
        } finally {
            super.dispose();
        }
    }
}
