package com.kuka.fri;

import com.kuka.sensitivity.LBR;

import heptarm.doubles2.Behind;

/** Settings of an FRI session. */
public final class FRIConfiguration {
    final heptarm.sunrise1.connectivity.fastRobotInterface.FRIConfiguration behind;

    private FRIConfiguration(String host) {
        behind = heptarm.sunrise1.connectivity.fastRobotInterface.FRIConfiguration.createRemoteConfiguration(Behind.robot(), host);
    }

    public static FRIConfiguration createRemoteConfiguration(LBR robot, String host) {
        return new FRIConfiguration(host);
    }

    public void setPortOnRemote(int port) {
        behind.setPortOnRemote(port);
    }

    public void setSendPeriodMilliSec(int period) {
        behind.setSendPeriodMilliSec(period);
    }

    public void setReceiveMultiplier(int multiplier) {
        behind.setReceiveMultiplier(multiplier);
    }
}
