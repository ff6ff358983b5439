package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.batch;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.circ;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.spl;

import java.io.PrintWriter;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.motionModel.CIRC;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;
import com.kuka.roboticsAPI.motionModel.LIN;
import com.kuka.roboticsAPI.motionModel.MotionBatch;
import com.kuka.roboticsAPI.motionModel.OrientationReferenceSystem;
import com.kuka.roboticsAPI.motionModel.PTP;
import com.kuka.roboticsAPI.motionModel.Spline;
import com.kuka.roboticsAPI.motionModel.SplineJP;
import com.kuka.roboticsAPI.motionModel.SplineOrientationType;

/** Arcs, splines and batches as a Sunrise programmer writes them; each step leaves a line that the test reads. */
public class Curving extends RoboticsAPIApplication {
    private static final double[] READY = {0.0, 0.5, 0.0, -1.3, 0.0, 1.3416, 0.0};

    @Inject
    private LBR lbr;

    private PrintWriter out;
    private Frame start;

    @Override
    public void initialize() {
        try {
            out = new PrintWriter(getApplicationData().getProcessData("sample.file").<String>getValue(), "UTF-8");
        } catch (java.io.IOException e) {
            throw new IllegalStateException(e);
        }
    }

    @Override
    public void run() throws Exception {
        lbr.move(ptp(READY));
        start = here();
        arcs();
        batches();
        splines();
        refusals();
        out.close();
    }

    private void arcs() {
        lbr.move(circ(at(50, 50, 0), at(0, 100, 0)).setCartVelocity(300));
        say("a circ arrives", here().distanceTo(at(0, 100, 0)) < 0.2);
        Frame turned = at(0, 100, 0);
        turned.setAlphaRad(turned.getAlphaRad() + 0.3);
        lbr.move(lin(turned));
        say("a lin turns", Math.abs(here().getAlphaRad() - turned.getAlphaRad()) < 1e-3);
        lbr.move(lin(start).setOrientationType(SplineOrientationType.Constant).setCartVelocity(300));
        say("a constant orientation stays", Math.abs(here().getAlphaRad() - turned.getAlphaRad()) < 1e-3);
        lbr.move(ptp(READY));
        lbr.move(circ(at(50, 50, 0), at(0, 100, 0)).setOrientationType(SplineOrientationType.Constant)
                .setOrientationReferenceSystem(OrientationReferenceSystem.Path).setCartVelocity(300));
        double angle = here().getAlphaRad() - start.getAlphaRad();
        say("relative to the path it turns along", Math.abs(Math.abs(Math.IEEEremainder(angle, 2 * Math.PI)) - Math.PI) < 2e-3);
        lbr.move(ptp(READY));
        lbr.move(lin(at(0, 50, 50)).setOrientationType(SplineOrientationType.OriJoint));
        say("led by the joints it arrives as well", here().distanceTo(at(0, 50, 50)) < 0.2);
        lbr.move(ptp(READY));
    }

    private void batches() {
        LIN one = lin(at(0, 100, 0)).setCartVelocity(250);
        LIN two = lin(at(80, 100, 0));
        CIRC three = circ(at(40, 60, 0), at(0, 0, 0));
        List<String> heard = Collections.synchronizedList(new ArrayList<String>());
        IMotion[] members = {one, two, three};
        MotionBatch batch = batch(one, two, three).setBlendingCart(20).setJointVelocityRel(0.8);
        IMotionContainer done = lbr.move(batch, new IMotionContainerListener() {
            @Override
            public void onStateChanged(IExecutionContainer container, ExecutionState state) {
            }

            @Override
            public void containerFinished(IMotionContainer container) {
                heard.add("end");
            }

            @Override
            public void motionFinished(IMotion motion) {
                heard.add("-" + index(motion));
            }

            @Override
            public void motionStarted(IMotion motion) {
                heard.add("+" + index(motion));
            }

            private int index(IMotion motion) {
                return java.util.Arrays.asList(members).indexOf(motion);
            }
        });
        say("one container for the batch", done.isFinished() && !done.hasError() && here().distanceTo(start) < 0.2);
        for (int i = 0; i < 200 && heard.size() < 7; i++) {
            pause(5);
        }
        say("its motions are reported in order", heard.toString().equals("[+0, -0, +1, -1, +2, -2, end]"));

        IMotionContainer cut = lbr.moveAsync(new MotionBatch(lin(at(0, 100, 0)).setBlendingRel(0.3),
                lin(at(80, 100, 0)).setBlendingRel(0.3), lin(at(80, 0, 0)).setBlendingRel(0.3), lin(start)));
        double nearest = 1e3;
        while (!cut.isFinished()) {
            nearest = Math.min(nearest, here().distanceTo(at(80, 100, 0)));
            pause(1);
        }
        say("blending cuts the corner", nearest > 3 && nearest < 30 && here().distanceTo(start) < 0.2);
        IMotionContainer running = lbr.moveAsync(new MotionBatch(ptp(1.2, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.2),
                linRel(0, 0, 50)));
        pause(400);
        running.cancel();
        running.await();
        say("cancelling ends all of it", running.isFinished() && !running.hasError()
                && lbr.getCurrentJointPosition().get(0) < 1.0);
        lbr.move(ptp(READY));
    }

    private void splines() {
        Spline curve = new Spline(spl(at(30, 50, 0)), spl(at(0, 100, 30)).setCartVelocity(100), lin(at(0, 150, 30)), spl(start))
                .setCartVelocity(200).setJointJerkRel(0.9);
        lbr.move(curve);
        say("a spline arrives", here().distanceTo(start) < 0.2);
        lbr.move(new Spline(lin(at(0, 50, 0)), circ(at(20 - 14.142, 50 + 14.142, 0), at(20, 70, 0))));
        say("with lines and arcs", here().distanceTo(at(20, 70, 0)) < 0.2);
        PTP through = ptp(0.3, 0.4, 0.1, -1.0, 0.1, 0.8, 0.2).setJointVelocityRel(0.3);
        lbr.move(new SplineJP(through, ptp(-0.2, 0.6, 0.0, -1.3, 0.0, 0.9, 0.0), ptp(READY)).setJointVelocityRel(0.7));
        say("a joint spline arrives", here().distanceTo(start) < 0.5);
    }

    private void refusals() {
        say("two points make no circle", fails(circ(at(0, 50, 0), at(0, 50, 0)), "apart"));
        say("a batch names the motion that cannot be planned",
                fails(batch(lin(at(0, 50, 0)), ptp(0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0)), "motion 2"));
        boolean empty = false;
        try {
            new Spline();
        } catch (IllegalArgumentException e) {
            empty = true;
        }
        say("a spline has segments", empty);
        say("and nothing has moved", here().distanceTo(start) < 0.5);
    }

    private boolean fails(IMotion motion, String words) {
        try {
            lbr.move(motion);
            return false;
        } catch (CommandInvalidException e) {
            return e.getMessage().contains(words);
        }
    }

    private Frame here() {
        return lbr.getCurrentCartesianPosition(lbr.getFlange(), World.Current.getRootFrame());
    }

    private Frame at(double x, double y, double z) {
        return new Frame(start.getX() + x, start.getY() + y, start.getZ() + z, start.getAlphaRad(), start.getBetaRad(),
                start.getGammaRad());
    }

    private static void pause(long millis) {
        try {
            Thread.sleep(millis);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private void say(String what, boolean isSo) {
        out.println(what + " = " + isSo);
        out.flush();
    }
}
