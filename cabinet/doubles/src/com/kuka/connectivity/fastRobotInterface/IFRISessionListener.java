package com.kuka.connectivity.fastRobotInterface;

/** Hears of an FRI session. */
public interface IFRISessionListener {
    void onFRISessionStateChanged(FRIChannelInformation friChannelInformation);

    void onFRIConnectionQualityChanged(FRIChannelInformation friChannelInformation);
}
