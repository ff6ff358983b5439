package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;
import java.util.Collections;
import java.util.List;
import java.util.Set;
import java.util.TreeSet;
import java.util.concurrent.Callable;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.ExecutionMode;
import com.kuka.roboticsAPI.controllerModel.IExecutionListener;
import com.kuka.roboticsAPI.controllerModel.sunrise.ControllerStateListenerAdapter;
import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseController;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseExecutionService;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState.EmergencyStop;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState.EnablingDeviceState;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState.SafetyStopType;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.OperationMode;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IErrorHandler;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

/** Lives through an emergency stop, a drive error and the operation mode T2; each step leaves a line that the test reads. */
public class Stopping extends RoboticsAPIApplication implements IErrorHandler, IExecutionListener {
    @Inject
    private LBR lbr;
    @Inject
    private Controller controller;
    @Inject
    private IApplicationControl control;

    private final Set<String> events = Collections.synchronizedSet(new TreeSet<String>());
    private volatile String failure;
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
        controller.addControllerListener(new ControllerStateListenerAdapter() {
            @Override
            public void onSafetyStateChanged(Device device, SunriseSafetyState state) {
                events.add("safety " + state.getSafetyStopSignal());
            }

            @Override
            public void onIsReadyToMoveChanged(Device device, boolean isReadyToMove) {
                events.add("ready " + isReadyToMove);
            }
        });
    }

    @Override
    public void run() throws Exception {
        final SunriseExecutionService service = (SunriseExecutionService) controller.getExecutionService();
        service.addExecutionListener(this);
        say("ready", lbr.isReadyToMove() && lbr.getOperationMode().isModeAuto() && !getRecovery().isRecoveryRequired());
        IMotionContainer slow = lbr.moveAsync(ptp(1.5, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.03));
        until(new Callable<Boolean>() {
            public Boolean call() {
                return lbr.getSafetyState().getEmergencyStopInt() == EmergencyStop.ACTIVE && service.isPausedAndStopped();
            }
        });
        say("an emergency stop pauses", service.isPaused() && !lbr.isReadyToMove() && !slow.isFinished()
                && lbr.getSafetyState().getSafetyStopSignal() == SafetyStopType.STOP1);
        until(new Callable<Boolean>() {
            public Boolean call() {
                return lbr.getSafetyState().getEmergencyStopInt() == EmergencyStop.INACTIVE;
            }
        });
        double before = lbr.getCurrentJointPosition().get(0);
        ThreadUtil.milliSleep(300);
        say("releasing it does not move the arm", service.isPaused() && !slow.isFinished()
                && Math.abs(lbr.getCurrentJointPosition().get(0) - before) < 1e-4);
        service.resumeExecution(ResumeMode.OnPath);
        until(new Callable<Boolean>() {
            public Boolean call() {
                return lbr.isReadyToMove();
            }
        });
        until(new Callable<Boolean>() {
            public Boolean call() {
                return failure != null;
            }
        });
        say("a drive error fails the motion", slow.hasError() && failure.contains("drive error in A2")
                && lbr.getCurrentJointPosition().get(0) > before + 1e-3);
        say("and switches the drives off", !lbr.isReadyToMove()
                && lbr.getSafetyState().getSafetyStopSignal() == SafetyStopType.STOP0);
        ((SunriseController) controller).acknowledgeError();
        service.resumeExecution(ResumeMode.OnPath);
        until(new Callable<Boolean>() {
            public Boolean call() {
                return lbr.isReadyToMove();
            }
        });
        until(new Callable<Boolean>() {
            public Boolean call() {
                return lbr.getOperationMode() == OperationMode.T2;
            }
        });
        say("T2 needs the enabling switch", !lbr.isReadyToMove()
                && lbr.getSafetyState().getEnablingDeviceState() == EnablingDeviceState.NONE);
        until(new Callable<Boolean>() {
            public Boolean call() {
                return lbr.getSafetyState().getEnablingDeviceState() == EnablingDeviceState.NORMAL;
            }
        });
        service.resumeExecution(ResumeMode.OnPath);
        lbr.move(ptp(0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.5));
        say("and then moves", Math.abs(lbr.getCurrentJointPosition().get(0)) < 1e-3);
        control.clipManualOverride(0.5);
        say("listeners", events);
    }

    private static void until(Callable<Boolean> condition) throws Exception {
        for (int i = 0; !condition.call(); i++) {
            if (i > 4000) {
                throw new IllegalStateException("it never came");
            }
            ThreadUtil.milliSleep(10);
        }
    }

    @Override
    public ErrorHandlingAction handleError(Device device, IMotionContainer failed, List<IMotionContainer> canceled) {
        failure = failed.getErrorMessage();
        return ErrorHandlingAction.Ignore;
    }

    @Override
    public void onExecutionPaused(Controller paused) {
        events.add("paused");
    }

    @Override
    public void onExecutionResumed(Controller resumed, ResumeMode resumeMode) {
        events.add("resumed");
    }

    @Override
    public void onExecutionModeChanged(Controller changed, ExecutionMode mode) {
        events.add("mode");
    }

    @Override
    public void dispose() {
        out.close();
        super.dispose();
    }

    private void say(String what, Object value) {
        out.println(what + " = " + value);
        out.flush();
    }
}
