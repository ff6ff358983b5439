package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.spl;

import java.io.PrintWriter;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.ICallbackAction;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.MotionPathCondition;
import com.kuka.roboticsAPI.conditionModel.ReferenceType;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;
import com.kuka.roboticsAPI.executionModel.IFiredTriggerInfo;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;
import com.kuka.roboticsAPI.motionModel.MotionBatch;
import com.kuka.roboticsAPI.motionModel.RobotMotion;
import com.kuka.roboticsAPI.motionModel.SplineMotionCP;
import com.kuka.roboticsAPI.motionModel.Spline;

/** Triggers on motions of a batch and segments of a spline as a Sunrise programmer writes them, and who receives what. */
public class Triggering extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    private final List<String> reported = Collections.synchronizedList(new ArrayList<String>());
    private PrintWriter out;

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
        lbr.move(ptp(0, 0.5, 0, -1.3, 0, Math.PI - 1.8, 0));
        RobotMotion<?> first = linRel(0, 80, 0, lbr.getRootFrame()).setCartVelocity(100).setBlendingCart(20);
        RobotMotion<?> second = linRel(0, 0, 80, lbr.getRootFrame()).setCartVelocity(100);
        ICondition middle = new MotionPathCondition(ReferenceType.START, 40, 0);
        ICondition late = new MotionPathCondition(ReferenceType.DEST, -20, 0);
        ICondition whole = new MotionPathCondition(ReferenceType.DEST, 0, 0);
        first.triggerWhen(middle, say("first"));
        second.triggerWhen(late, say("second"));
        IMotionContainer batch = lbr.move(new MotionBatch(first, second).triggerWhen(whole, say("whole")));
        for (int i = 0; i < 3000 && reported.size() < 3; i++) { // listeners are called by a thread of their own
            ThreadUtil.milliSleep(10);
        }
        say("triggers of a batch's motions go off in order", reported.toString().equals("[first, second, whole]"));
        say("the container knows", batch.hasFired(middle) && batch.hasFired(late) && batch.hasFired(whole));

        reported.clear();
        Frame here = lbr.getCurrentCartesianPosition(lbr.getFlange());
        SplineMotionCP<?> curved = spl(moved(here, 0, -40, -20));
        SplineMotionCP<?> straight = lin(moved(here, 0, -80, -20));
        curved.triggerWhen(new MotionPathCondition(ReferenceType.START, 10, 0), say("curved"));
        straight.triggerWhen(new MotionPathCondition(ReferenceType.START, 10, 0), say("straight"));
        final Spline spline = new Spline(curved, straight).setCartVelocity(100);
        final IMotion[] motions = {spline, curved, straight};
        final boolean[] current = new boolean[1];
        IMotionContainer block = lbr.moveAsync(spline, new IMotionContainerListener() {
            public void onStateChanged(IExecutionContainer container, ExecutionState state) {
            }

            public void containerFinished(IMotionContainer finished) {
                reported.add("end");
            }

            public void motionFinished(IMotion motion) {
                reported.add("-" + index(motions, motion));
            }

            public void motionStarted(IMotion motion) {
                reported.add("+" + index(motions, motion));
            }
        });
        while (!block.isFinished()) {
            current[0] |= block.getCurrentMotion() == spline;
            ThreadUtil.milliSleep(20);
        }
        for (int i = 0; i < 3000 && !reported.contains("end"); i++) { // listeners are called by a thread of their own
            ThreadUtil.milliSleep(10);
        }
        say("a listener receives segments", reported.toString().equals("[+0, +1, curved, -1, +2, straight, -2, -0, end]"));
        say("the motion is the spline", current[0] && block.getLastExecutedMotion() == spline);
        try {
            lbr.move(new MotionBatch(linRel(0, 10, 0).breakWhen(whole)));
            say("break conditions of a part are refused", false);
        } catch (RuntimeException e) {
            say("break conditions of a part are refused", true);
        }
    }

    private static int index(IMotion[] motions, IMotion motion) {
        for (int i = 0; i < motions.length; i++) {
            if (motions[i] == motion) {
                return i;
            }
        }
        return -1;
    }

    private static Frame moved(Frame from, double x, double y, double z) {
        Frame frame = from.copy();
        frame.setX(from.getX() + x);
        frame.setY(from.getY() + y);
        frame.setZ(from.getZ() + z);
        return frame;
    }

    private ICallbackAction say(final String name) {
        return new ICallbackAction() {
            public void onTriggerFired(IFiredTriggerInfo info) {
                reported.add(name);
            }
        };
    }

    private void say(String what, boolean is) {
        out.println(what + " = " + is + (is ? "" : " " + reported));
        out.flush();
    }
}
