package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;

import javax.inject.Inject;

import com.kuka.connectivity.fastRobotInterface.ClientCommandMode;
import com.kuka.connectivity.fastRobotInterface.FRIChannelInformation;
import com.kuka.connectivity.fastRobotInterface.FRIChannelInformation.FRISessionState;
import com.kuka.connectivity.fastRobotInterface.FRIConfiguration;
import com.kuka.connectivity.fastRobotInterface.FRIJointOverlay;
import com.kuka.connectivity.fastRobotInterface.FRISession;
import com.kuka.connectivity.fastRobotInterface.IFRISessionListener;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;

/** Waits for its client, which overlays a position that it holds, a motion, and a compliant position with a wrench. */
public class FriSine extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;
    private FRISession session;
    private volatile boolean commanded;

    @Override
    public void run() throws Exception {
        int port = getApplicationData().getProcessData("lab.fri").getValue();
        FRIConfiguration configuration = FRIConfiguration.createRemoteConfiguration(lbr, "127.0.0.1");
        configuration.setSendPeriodMilliSec(20);
        configuration.setPortOnRemote(port);
        getLogger().info(configuration.getHostName() + ":" + configuration.getPortOnRemote() + " every "
                + configuration.getSendPeriodMilliSec() + " ms");
        session = new FRISession(configuration);
        session.addFRISessionListener(new IFRISessionListener() {
            @Override
            public void onFRISessionStateChanged(FRIChannelInformation information) {
                commanded |= information.getFRISessionState() == FRISessionState.COMMANDING_ACTIVE;
            }

            @Override
            public void onFRIConnectionQualityChanged(FRIChannelInformation information) {
                getLogger().info("quality " + information.getQuality());
            }
        });
        lbr.move(ptp(0, 0.5, 0, -1.2, 0, 0.9, 0).setJointVelocityRel(0.5));
        try {
            session.await(60, TimeUnit.SECONDS);
        } catch (TimeoutException error) {
            Report.line(getApplicationData(), "FriSine nobody answers");
            return;
        }
        FRIJointOverlay position = new FRIJointOverlay(session);
        lbr.move(positionHold(new PositionControlMode(), 3, TimeUnit.SECONDS).addMotionOverlay(position));
        boolean hasMoved = Math.abs(lbr.getCurrentJointPosition().get(6)) > 0.02;
        lbr.move(ptp(0.3, 0.5, 0, -1.2, 0, 0.9, 0).setJointVelocityRel(0.2).addMotionOverlay(position));
        boolean hasArrived = Math.abs(lbr.getCurrentJointPosition().get(0) - 0.3) < 0.01;
        hasMoved &= hasArrived && Math.abs(lbr.getCurrentJointPosition().get(6)) > 0.02;
        FRIJointOverlay wrench = new FRIJointOverlay(session, ClientCommandMode.WRENCH);
        lbr.move(positionHold(new CartesianImpedanceControlMode(), 1, TimeUnit.SECONDS).addMotionOverlay(wrench));
        FRIChannelInformation channel = session.getFRIChannelInformation();
        boolean isOpen = channel.getFRISessionState() != FRISessionState.IDLE && channel.getJitter() >= 0;
        session.close();
        lbr.move(ptp(0, 0.5, 0, -1.2, 0, 0.9, 0.1).setJointVelocityRel(0.5));
        Report.line(getApplicationData(), "FriSine " + commanded + " " + hasMoved + " " + isOpen);
        Report.joints(getApplicationData(), "FriSine", lbr);
    }

    @Override
    public void dispose() {
        if (session != null) {
            session.close();
        }
        super.dispose();
    }
}
