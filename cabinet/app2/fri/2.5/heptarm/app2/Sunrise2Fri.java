package heptarm.app2;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;

import java.util.concurrent.TimeUnit;

import com.kuka.fri.FRIChannelInformation;
import com.kuka.fri.FRIConfiguration;
import com.kuka.fri.FRIJointOverlay;
import com.kuka.fri.FRISession;
import com.kuka.fri.IFRISessionListener;
import com.kuka.fri.common.ClientCommandMode;
import com.kuka.sensitivity.LBR;

import heptarm.core.CommandRejected;
import heptarm.core.robot.FriSession;
import heptarm.core.robot.MotionJob;
import heptarm.wire.FriOpen;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;

/** An FRI session of Sunrise 2.x with FRI 2.5 (packages com.kuka.fri). */
final class Sunrise2Fri implements FriSession, IFRISessionListener {
    static final String[] CAPABILITIES = Sunrise2Overlays.CAPABILITIES;

    private final FriOpen open;
    private final Sunrise2Motions motions;
    private final FriSession.Listener listener;
    private final FRISession session;

    private Sunrise2Fri(FriOpen open, LBR lbr, Sunrise2Motions motions, FriSession.Listener listener) {
        this.open = open;
        this.motions = motions;
        this.listener = listener;
        FRIConfiguration configuration = FRIConfiguration.createRemoteConfiguration(lbr, open.host);
        configuration.setPortOnRemote(open.port);
        configuration.setSendPeriodMilliSec(Sunrise2Overlays.milliseconds(open.period));
        configuration.setReceiveMultiplier(open.receive_multiplier);
        session = new FRISession(configuration);
        session.addFRISessionListener(this);
    }

    static void check(FriOpen open) throws CommandRejected {
        Sunrise2Overlays.check(open);
    }

    static FriSession of(FriOpen open, LBR lbr, Sunrise2Motions motions, FriSession.Listener listener) {
        Sunrise2Fri fri = new Sunrise2Fri(open, lbr, motions, listener);
        fri.report(fri.session.getFRIChannelInformation()); // the state before the listener was added
        return fri;
    }

    @Override
    public MotionJob command(MotionJob.Listener jobListener) {
        return motions.start(positionHold(Sunrise2Modes.of(open.mode), -1, TimeUnit.SECONDS)
                .addMotionOverlay(new FRIJointOverlay(session, ClientCommandMode.JOINT_POSITION)), jobListener);
    }

    @Override
    public void close() {
        session.close();
    }

    @Override
    public void onFRISessionStateChanged(FRIChannelInformation information) {
        report(information);
    }

    @Override
    public void onFRIConnectionQualityChanged(FRIChannelInformation information) {
        report(information);
    }

    private void report(FRIChannelInformation information) {
        listener.changed(FriSessionState.valueOf(information.getFRISessionState().name()),
                FriQuality.valueOf(information.getQuality().name()));
    }
}
