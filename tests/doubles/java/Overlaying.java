package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;
import java.util.Collections;
import java.util.LinkedHashSet;
import java.util.Set;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.connectivity.fastRobotInterface.ClientCommandMode;
import com.kuka.connectivity.fastRobotInterface.FRIChannelInformation;
import com.kuka.connectivity.fastRobotInterface.FRIChannelInformation.FRISessionState;
import com.kuka.connectivity.fastRobotInterface.FRIConfiguration;
import com.kuka.connectivity.fastRobotInterface.FRIJointOverlay;
import com.kuka.connectivity.fastRobotInterface.FRISession;
import com.kuka.connectivity.fastRobotInterface.IFRISessionListener;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.ioModel.AbstractIOGroup;
import com.kuka.roboticsAPI.ioModel.IOTypes;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.PositionHold;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;

/** An FRI application as Sunrise programmers write it; each step leaves a line that the test reads. */
public class Overlaying extends RoboticsAPIApplication implements IFRISessionListener {
    /** As a project's generated groups are. */
    private static final class Signals extends AbstractIOGroup {
        Signals(Controller controller) {
            super(controller, "Sample");
            addInput("Button", IOTypes.BOOLEAN, 1);
            addDigitalOutput("Count", IOTypes.UNSIGNED_INTEGER, 8);
            addDigitalOutput("Offset", IOTypes.INTEGER, 8);
            addAnalogOutput("Level", IOTypes.ANALOG, 12, 0, 10);
        }

        long count() {
            return getNumberIOValue("Count", true).longValue();
        }

        long offset() {
            return getNumberIOValue("Offset", true).longValue();
        }

        double level() {
            return getAnalogIOValue("Level", true);
        }
    }

    @Inject
    private LBR lbr;

    private final Set<FRISessionState> seen = Collections.synchronizedSet(new LinkedHashSet<FRISessionState>());
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
        int port = getApplicationData().getProcessData("sample.port").getValue();
        lbr.move(ptp(0, 0.5, 0, -1.3, 0, 0.9, 0));
        FRIConfiguration configuration = FRIConfiguration.createRemoteConfiguration(lbr, "127.0.0.1");
        configuration.setSendPeriodMilliSec(20); // a busy machine answers in time, too
        configuration.setReceiveMultiplier(1);
        configuration.setPortOnRemote(port);
        Signals signals = new Signals(lbr.getController());
        configuration.registerIO(signals.getInput("Button"));
        configuration.registerIO(signals.getOutput("Count"));
        configuration.registerIO(signals.getOutput("Offset"));
        configuration.registerIO(signals.getOutput("Level"));
        boolean refused = false;
        try {
            configuration.setSendPeriodMilliSec(0);
        } catch (IllegalArgumentException e) {
            refused = true;
        }
        say("a bad period throws", refused);
        FRISession session = new FRISession(configuration);
        session.addFRISessionListener(this);
        session.await(60, TimeUnit.SECONDS);
        say("the client answers", session.getFRIChannelInformation().getLatency() >= 0);
        double before = lbr.getCurrentJointPosition().get(6);
        PositionHold hold = new PositionHold(new PositionControlMode(), -1, TimeUnit.SECONDS);
        IMotionContainer container =
                lbr.moveAsync(hold.addMotionOverlay(new FRIJointOverlay(session, ClientCommandMode.POSITION)));
        for (int i = 0; i < 100 && lbr.getCurrentJointPosition().get(6) < before + 0.09; i++) {
            ThreadUtil.milliSleep(50);
        }
        say("the client moves the arm", lbr.getCurrentJointPosition().get(6) > before + 0.09);
        say("commanding is active",
                session.getFRIChannelInformation().getFRISessionState() == FRISessionState.COMMANDING_ACTIVE);
        say("the client's outputs are the cabinet's", signals.offset() == -3 && signals.level() == 2.5);
        say("an output out of its range is not written", signals.count() == 0);
        container.cancel();
        for (int i = 0; i < 3000 && !container.isFinished(); i++) { // listeners are called by a thread of their own
            ThreadUtil.milliSleep(10);
        }
        say("cancelling the motion ends the overlay", container.isFinished() && !container.hasError());
        for (int i = 0; i < 200
                && session.getFRIChannelInformation().getFRISessionState() != FRISessionState.MONITORING_READY; i++) {
            ThreadUtil.milliSleep(50);
        }
        say("the session monitors on",
                session.getFRIChannelInformation().getFRISessionState() == FRISessionState.MONITORING_READY);
        session.close();
        for (int i = 0; i < 3000 && !seen.contains(FRISessionState.IDLE); i++) { // listeners are called by a thread of their own
            ThreadUtil.milliSleep(10);
        }
        say("all states were reported", seen.contains(FRISessionState.COMMANDING_WAIT)
                && seen.contains(FRISessionState.COMMANDING_ACTIVE) && seen.contains(FRISessionState.IDLE));
        configuration.setPortOnRemote(port + 1);
        boolean late = false;
        FRISession nobody = new FRISession(configuration);
        try {
            nobody.await(300, TimeUnit.MILLISECONDS);
        } catch (TimeoutException e) {
            late = true;
        }
        nobody.close();
        say("without a client await times out", late);
    }

    @Override
    public void onFRISessionStateChanged(FRIChannelInformation information) {
        seen.add(information.getFRISessionState());
    }

    @Override
    public void onFRIConnectionQualityChanged(FRIChannelInformation information) {
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
