package com.kuka.fri;

/** An FRI session. */
public final class FRISession {
    final heptarm.sunrise1.connectivity.fastRobotInterface.FRISession behind;

    public FRISession(FRIConfiguration configuration) {
        behind = new heptarm.sunrise1.connectivity.fastRobotInterface.FRISession(configuration.behind);
    }

    public FRIChannelInformation getFRIChannelInformation() {
        return new FRIChannelInformation(behind.getFRIChannelInformation());
    }

    public void addFRISessionListener(IFRISessionListener listener) {
        behind.addFRISessionListener(new heptarm.sunrise1.connectivity.fastRobotInterface.IFRISessionListener() {
            @Override
            public void onFRISessionStateChanged(heptarm.sunrise1.connectivity.fastRobotInterface.FRIChannelInformation now) {
                listener.onFRISessionStateChanged(new FRIChannelInformation(now));
            }

            @Override
            public void onFRIConnectionQualityChanged(heptarm.sunrise1.connectivity.fastRobotInterface.FRIChannelInformation now) {
                listener.onFRIConnectionQualityChanged(new FRIChannelInformation(now));
            }
        });
    }

    public void close() {
        behind.close();
    }
}
