package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseExecutionService;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IErrorHandler;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;

/** Queues, listeners, pauses and ends by an exception; each step leaves a line that the test reads. */
public class Queueing extends RoboticsAPIApplication implements IErrorHandler, IMotionContainerListener {
    @Inject
    private LBR lbr;
    @Inject
    private Controller controller;
    @Inject
    private IApplicationControl control;

    private final List<String> events = Collections.synchronizedList(new ArrayList<String>());
    private volatile List<IMotionContainer> cancelled;
    private PrintWriter out;

    @Override
    public void initialize() {
        try {
            String file = getApplicationData().getProcessData("sample.file").getValue();
            out = new PrintWriter(file, "UTF-8");
        } catch (java.io.IOException e) {
            throw new IllegalStateException(e);
        }
        control.registerMoveAsyncErrorHandler(this);
        int count = getApplicationData().getProcessData("sample.count").getValue();
        double gain = getApplicationData().getProcessData("sample.gain").getValue();
        boolean open = getApplicationData().getProcessData("sample.open").getValue();
        say("process data have their types", count == 7 && gain == 0.25 && open);
    }

    @Override
    public void run() throws Exception {
        SunriseExecutionService service = (SunriseExecutionService) controller.getExecutionService();
        lbr.move(ptp(0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0));
        say("nothing is active after a move", service.getActiveMotionContainerCount() == 0);

        IMotionContainer reported = lbr.moveAsync(ptp(0.2, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0), this);
        reported.await();
        for (int i = 0; i < 100 && !events.contains("containerFinished"); i++) {
            ThreadUtil.milliSleep(10);
        }
        say("listener", events);

        // slow enough for a machine that is busy with something else
        IMotionContainer slow = lbr.moveAsync(ptp(0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.03));
        IMotionContainer waiting = lbr.moveAsync(ptp(0.1, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0));
        say("two are active", service.getActiveMotionContainerCount() == 2);
        waiting.cancel();
        waiting.await();
        say("a cancelled one in the queue is no error", waiting.isFinished() && !waiting.hasError());
        service.startPause();
        ThreadUtil.milliSleep(700);
        double paused = lbr.getCurrentJointPosition().get(0);
        boolean ready = lbr.isReadyToMove();
        try {
            slow.await(400, TimeUnit.MILLISECONDS);
            say("a pause stops time", false);
        } catch (TimeoutException e) {
            say("a pause stops time", !ready && service.isPaused()
                    && Math.abs(lbr.getCurrentJointPosition().get(0) - paused) < 1e-3);
        }
        service.resumeExecution(ResumeMode.OnPath);
        slow.await();
        say("and resuming ends the motion", !slow.hasError() && Math.abs(lbr.getCurrentJointPosition().get(0)) < 1e-3);

        Frame above = lbr.getCurrentCartesianPosition(lbr.getFlange());
        Frame child = new Frame(above, 0, 0, 10, 0, 0, 0);
        say("a frame in a frame", Math.abs(above.transformationTo(child).getZ() - 10) < 1e-9
                && child.getRedundancyInformationForDevice(lbr) == null
                && above.copyWithRedundancy().getRedundancyInformationForDevice(lbr) != null);

        lbr.moveAsync(ptp(1.5, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.3));
        ThreadUtil.milliSleep(400);
        throw new IllegalStateException("an error of the application");
    }

    @Override
    public ErrorHandlingAction handleError(Device device, IMotionContainer failed, List<IMotionContainer> canceled) {
        cancelled = canceled;
        return ErrorHandlingAction.Ignore;
    }

    @Override
    public void dispose() {
        double before = lbr.getCurrentJointPosition().get(0);
        ThreadUtil.milliSleep(1000);
        double at = lbr.getCurrentJointPosition().get(0);
        ThreadUtil.milliSleep(200);
        say("an exception stops the motion", before > 0.01 && at < 1.4
                && Math.abs(lbr.getCurrentJointPosition().get(0) - at) < 1e-4 && !lbr.hasActiveMotionCommand());
        say("no asynchronous error", cancelled == null);
        out.close();
        super.dispose();
    }

    @Override
    public void onStateChanged(IExecutionContainer container, ExecutionState state) {
        events.add(state.toString());
    }

    @Override
    public void containerFinished(IMotionContainer container) {
        events.add("containerFinished");
    }

    @Override
    public void motionFinished(IMotion motion) {
        events.add("motionFinished");
        throw new IllegalStateException("a careless listener");
    }

    @Override
    public void motionStarted(IMotion motion) {
        events.add("motionStarted");
    }

    private void say(String what, Object value) {
        out.println(what + " = " + value);
        out.flush();
    }
}
