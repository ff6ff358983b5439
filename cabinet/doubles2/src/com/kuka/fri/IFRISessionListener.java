package com.kuka.fri;

/** Receives changes of a session. */
public interface IFRISessionListener {
    void onFRISessionStateChanged(FRIChannelInformation information);

    void onFRIConnectionQualityChanged(FRIChannelInformation information);
}
