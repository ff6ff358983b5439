package com.kuka.fri.api.monitoring;

/** Receives changes of a session. */
public interface IFriSessionListener {
    void onFriSessionStateChanged(IFriChannelInformation information);

    void onFriConnectionQualityChanged(IFriChannelInformation information);
}
