package com.kuka.connectivity.fastRobotInterface;

/** Called when the state or quality of an FRI session changes. */
public interface IFRISessionListener {
    void onFRISessionStateChanged(FRIChannelInformation friChannelInformation);

    void onFRIConnectionQualityChanged(FRIChannelInformation friChannelInformation);
}
