package com.kuka.fri.api.monitoring;

/** An FRI session. */
public interface IFriSession {
    void addFriSessionListener(IFriSessionListener listener);

    void close();
}
