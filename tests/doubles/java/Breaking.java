package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;
import java.util.Date;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicInteger;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.ConditionObserver;
import com.kuka.roboticsAPI.conditionModel.ForceComponentCondition;
import com.kuka.roboticsAPI.conditionModel.ForceCondition;
import com.kuka.roboticsAPI.conditionModel.IAnyEdgeListener;
import com.kuka.roboticsAPI.conditionModel.ICallbackAction;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.IRisingEdgeListener;
import com.kuka.roboticsAPI.conditionModel.JointTorqueCondition;
import com.kuka.roboticsAPI.conditionModel.MotionPathCondition;
import com.kuka.roboticsAPI.conditionModel.NotificationType;
import com.kuka.roboticsAPI.conditionModel.ObserverManager;
import com.kuka.roboticsAPI.conditionModel.ReferenceType;
import com.kuka.roboticsAPI.conditionModel.TorqueComponentCondition;
import com.kuka.roboticsAPI.deviceModel.JointEnum;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.IFiredTriggerInfo;
import com.kuka.roboticsAPI.geometricModel.math.CoordinateAxis;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

/** Break conditions, triggers and observers as a Sunrise programmer writes them; the test puts a table under the arm. */
public class Breaking extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;
    @Inject
    private ObserverManager observers;

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
        lbr.move(ptp(0, 0.5, 0, -1.3, 0, Math.PI - 1.8, 0));
        final AtomicInteger edges = new AtomicInteger();
        ICondition touch = ForceCondition.createNormalForceCondition(lbr.getFlange(), lbr.getRootFrame(), CoordinateAxis.Z, 10);
        ICondition never = new JointTorqueCondition(JointEnum.J1, -100, 100);
        ConditionObserver observer = observers.createConditionObserver(touch, NotificationType.EdgesOnly, new IAnyEdgeListener() {
            public void onAnyEdge(ConditionObserver one, Date time, int missed, boolean value) {
                edges.addAndGet(value ? 1 : 100);
            }
        });
        observer.enable();
        double before = height();
        IMotionContainer down = lbr.move(linRel(0, 0, -500, lbr.getRootFrame()).setCartVelocity(25).breakWhen(never).breakWhen(touch));
        say("a line down stops on the table and returns", !down.hasError() && height() > 290 && height() < before - 100);
        say("it reports which condition fired", down.getFiredBreakConditionInfo() != null && down.hasFired(touch)
                && !down.hasFired(never) && down.getFiredBreakConditionInfo().getFiredCondition() == touch);
        double pressed = lbr.getExternalForceTorque(lbr.getFlange(), lbr.getRootFrame()).getForce().getZ();
        say("the table pushes back", pressed > 8 && pressed < 200);
        IMotionContainer again = lbr.move(positionHold(null, 10, TimeUnit.SECONDS).breakWhen(touch.and(never.invert())));
        say("a condition that holds at the start ends the motion at once", again.getFiredBreakConditionInfo() != null);
        IMotionContainer up = lbr.move(linRel(0, 0, 80, lbr.getRootFrame()).setCartVelocity(100)
                .breakWhen(touch.and(never)).breakWhen(new TorqueComponentCondition(lbr.getFlange(), CoordinateAxis.X, -50, 50)));
        say("without a firing there is no info", up.getFiredBreakConditionInfo() == null && !up.hasFired(touch));
        // listeners are called by a thread of their own; an elastic arm may bounce, then there are more edges
        for (int i = 0; i < 3000 && (edges.get() < 101 || edges.get() % 100 != edges.get() / 100); i++) {
            ThreadUtil.milliSleep(10);
        }
        int heard = edges.get();
        say("the observer heard both edges", heard >= 101 && heard % 100 == heard / 100 && observer.isEnabled());
        observers.removeConditionObserver(observer);
        say("a removed one hears nothing", !observer.isEnabled() && observers.getRegisteredConditionObservers().isEmpty());

        final IMotionContainer[] reported = new IMotionContainer[1];
        final double[] at = new double[1];
        double start = height();
        ICondition half = new MotionPathCondition(ReferenceType.START, 50, 0);
        IMotionContainer triggered = lbr.move(linRel(0, 0, 100, lbr.getRootFrame()).setCartVelocity(100)
                .triggerWhen(half, new ICallbackAction() {
                    public void onTriggerFired(IFiredTriggerInfo info) {
                        reported[0] = info.getMotionContainer();
                        at[0] = height();
                    }
                }));
        say("a trigger calls back on the way", reported[0] == triggered && at[0] > start + 45 && at[0] < start + 99);
        say("and the motion arrives", Math.abs(height() - start - 100) < 1 && triggered.hasFired(half));
        IMotionContainer short_ = lbr.move(linRel(0, 0, -100, lbr.getRootFrame()).setCartVelocity(100)
                .breakWhen(new MotionPathCondition(ReferenceType.DEST, -30, 0)));
        say("30 mm before the end", short_.getFiredBreakConditionInfo() != null && Math.abs(height() - start - 30) < 12);
        say("waiting in vain", !observers.waitFor(touch, 50, TimeUnit.MILLISECONDS));
        say("waiting for what holds", observers.waitFor(touch.invert(), 5, TimeUnit.SECONDS));
        final AtomicInteger rising = new AtomicInteger();
        getObserverManager().createConditionObserver(touch.invert(), NotificationType.OnEnable, new IRisingEdgeListener() {
            public void onRisingEdge(ConditionObserver one, Date time, int missed) {
                rising.incrementAndGet();
            }
        }).enable();
        for (int i = 0; i < 3000 && rising.get() == 0; i++) { // listeners are called by a thread of their own
            ThreadUtil.milliSleep(10);
        }
        say("an observer receives what holds when it is enabled", rising.get() == 1);
        int refused = 0;
        for (int i = 0; i < 4; i++) {
            try {
                if (i == 0) {
                    new JointTorqueCondition(JointEnum.J1, 5, 5);
                } else if (i == 1) {
                    ForceCondition.createSpatialForceCondition(lbr.getFlange(), -1);
                } else if (i == 2) {
                    new ForceComponentCondition(lbr.getFlange(), CoordinateAxis.X, -1, 1, 0);
                } else {
                    new MotionPathCondition(ReferenceType.START, -5, 0);
                }
            } catch (IllegalArgumentException e) {
                refused++;
            }
        }
        say("bad values are refused", refused == 4);
    }

    private double height() {
        return lbr.getCurrentCartesianPosition(lbr.getFlange()).getZ();
    }

    private void say(String what, boolean is) {
        out.println(what + " = " + is);
        out.flush();
    }
}
