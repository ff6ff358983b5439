package com.kuka.fri.api.monitoring;

/** Settings of an FRI session. */
public interface IFriConfiguration {
    void setSendPeriodMilliSec(int period);

    void setReceiveMultiplier(int multiplier);
}
