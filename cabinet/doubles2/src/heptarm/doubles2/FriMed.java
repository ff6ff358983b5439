package heptarm.doubles2;

import com.kuka.fri.api.commanding.EClientCommandMode;
import com.kuka.fri.api.commanding.IFriCommanding;
import com.kuka.fri.api.commanding.IFriJointOverlay;
import com.kuka.fri.api.monitoring.IFriChannelInformation;
import com.kuka.fri.api.monitoring.IFriConfiguration;
import com.kuka.fri.api.monitoring.IFriMonitoring;
import com.kuka.fri.api.monitoring.IFriSession;
import com.kuka.fri.api.monitoring.IFriSessionListener;
import com.kuka.sensitivity.LBR;

import heptarm.sunrise1.connectivity.fastRobotInterface.FRIChannelInformation;
import heptarm.sunrise1.connectivity.fastRobotInterface.FRIConfiguration;
import heptarm.sunrise1.connectivity.fastRobotInterface.FRIJointOverlay;
import heptarm.sunrise1.connectivity.fastRobotInterface.FRISession;
import heptarm.sunrise1.connectivity.fastRobotInterface.IFRISessionListener;

/** FRI Med 3.0 over the FRI of 1.x. */
final class FriMed implements IFriMonitoring, IFriCommanding {
    private static final class Configuration implements IFriConfiguration {
        private final FRIConfiguration behind;

        Configuration(String host) {
            behind = FRIConfiguration.createRemoteConfiguration(Behind.robot(), host);
        }

        @Override
        public void setSendPeriodMilliSec(int period) {
            behind.setSendPeriodMilliSec(period);
        }

        @Override
        public void setReceiveMultiplier(int multiplier) {
            behind.setReceiveMultiplier(multiplier);
        }
    }

    private static final class Session implements IFriSession {
        private final FRISession behind;

        Session(Configuration configuration) {
            behind = new FRISession(configuration.behind);
        }

        @Override
        public void addFriSessionListener(IFriSessionListener listener) {
            behind.addFRISessionListener(new IFRISessionListener() {
                @Override
                public void onFRISessionStateChanged(FRIChannelInformation now) {
                    listener.onFriSessionStateChanged(information(now));
                }

                @Override
                public void onFRIConnectionQualityChanged(FRIChannelInformation now) {
                    listener.onFriConnectionQualityChanged(information(now));
                }
            });
        }

        private static IFriChannelInformation information(FRIChannelInformation now) {
            return new IFriChannelInformation() {
                @Override
                public FRIChannelInformation.FRISessionState getFriSessionState() {
                    return now.getFRISessionState();
                }

                @Override
                public FRIChannelInformation.FRIConnectionQuality getQuality() {
                    return now.getQuality();
                }
            };
        }

        @Override
        public void close() {
            behind.close();
        }
    }

    @Override
    public IFriConfiguration createFriConfiguration(LBR robot, String host) {
        return new Configuration(host);
    }

    @Override
    public IFriSession createFriSession(IFriConfiguration configuration) {
        return new Session((Configuration) configuration);
    }

    @Override
    public IFriJointOverlay createJointOverlay(IFriSession session, EClientCommandMode mode) {
        return () -> new FRIJointOverlay(((Session) session).behind);
    }
}
