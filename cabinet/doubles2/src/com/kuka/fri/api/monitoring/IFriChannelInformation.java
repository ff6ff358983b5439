package com.kuka.fri.api.monitoring;

import heptarm.sunrise1.connectivity.fastRobotInterface.FRIChannelInformation;

/** State of an FRI channel. */
public interface IFriChannelInformation {
    FRIChannelInformation.FRISessionState getFriSessionState();

    FRIChannelInformation.FRIConnectionQuality getQuality();
}
