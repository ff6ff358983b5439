package heptarm.app2;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;

import java.util.concurrent.TimeUnit;

import com.kuka.fri.api.commanding.EClientCommandMode;
import com.kuka.fri.api.commanding.IFriCommanding;
import com.kuka.fri.api.monitoring.IFriChannelInformation;
import com.kuka.fri.api.monitoring.IFriConfiguration;
import com.kuka.fri.api.monitoring.IFriMonitoring;
import com.kuka.fri.api.monitoring.IFriSession;
import com.kuka.fri.api.monitoring.IFriSessionListener;
import com.kuka.sensitivity.LBR;

import heptarm.core.CommandRejected;
import heptarm.core.robot.FriSession;
import heptarm.core.robot.MotionJob;
import heptarm.wire.Code;
import heptarm.wire.FriOpen;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;

/** An FRI session of Sunrise 2.x with FRI Med 3.0 (packages com.kuka.fri.api), whose clients speak FRI 2.7. */
final class Sunrise2Fri implements FriSession, IFriSessionListener {
    static final String[] CAPABILITIES = Sunrise2Overlays.CAPABILITIES;

    private final FriOpen open;
    private final Sunrise2Motions motions;
    private final LBR lbr;
    private final FriSession.Listener listener;
    private final IFriSession session;

    private Sunrise2Fri(FriOpen open, LBR lbr, Sunrise2Motions motions, FriSession.Listener listener) {
        this.open = open;
        this.lbr = lbr;
        this.motions = motions;
        this.listener = listener;
        IFriMonitoring monitoring = lbr.getCapability(IFriMonitoring.class);
        IFriConfiguration configuration = monitoring.createFriConfiguration(lbr, open.host);
        configuration.setSendPeriodMilliSec(Sunrise2Overlays.milliseconds(open.period));
        configuration.setReceiveMultiplier(open.receive_multiplier);
        session = monitoring.createFriSession(configuration);
        session.addFriSessionListener(this);
    }

    static void check(FriOpen open) throws CommandRejected {
        Sunrise2Overlays.check(open);
        if (open.port != Sunrise2Overlays.PORT) {
            throw new CommandRejected(Code.UNSUPPORTED, "port", Integer.toString(open.port), Integer.toString(Sunrise2Overlays.PORT),
                    "how FRI Med 3.0 selects the port of the client is unknown; the port must be " + Sunrise2Overlays.PORT + ", got "
                            + open.port);
        }
    }

    static FriSession of(FriOpen open, LBR lbr, Sunrise2Motions motions, FriSession.Listener listener) {
        return new Sunrise2Fri(open, lbr, motions, listener);
    }

    @Override
    public MotionJob command(MotionJob.Listener jobListener) {
        return motions.start(positionHold(Sunrise2Modes.of(open.mode), -1, TimeUnit.SECONDS).addMotionOverlay(
                lbr.getCapability(IFriCommanding.class).createJointOverlay(session, EClientCommandMode.JOINT_POSITION)), jobListener);
    }

    @Override
    public void close() {
        session.close();
    }

    @Override
    public void onFriSessionStateChanged(IFriChannelInformation information) {
        report(information);
    }

    @Override
    public void onFriConnectionQualityChanged(IFriChannelInformation information) {
        report(information);
    }

    private void report(IFriChannelInformation information) {
        listener.changed(FriSessionState.valueOf(information.getFriSessionState().toString()),
                FriQuality.valueOf(information.getQuality().toString()));
    }
}
