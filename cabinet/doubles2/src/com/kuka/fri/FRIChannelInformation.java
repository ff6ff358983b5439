package com.kuka.fri;

import com.kuka.fri.common.FRISessionState;

/** State of an FRI channel. */
public final class FRIChannelInformation {
    private final heptarm.sunrise1.connectivity.fastRobotInterface.FRIChannelInformation behind;

    FRIChannelInformation(heptarm.sunrise1.connectivity.fastRobotInterface.FRIChannelInformation behind) {
        this.behind = behind;
    }

    public FRISessionState getFRISessionState() {
        return FRISessionState.valueOf(behind.getFRISessionState().name());
    }

    public FRIConnectionQuality getQuality() {
        return FRIConnectionQuality.valueOf(behind.getQuality().name());
    }

    /** Quality of the connection. */
    public enum FRIConnectionQuality { POOR, FAIR, GOOD, EXCELLENT }
}
