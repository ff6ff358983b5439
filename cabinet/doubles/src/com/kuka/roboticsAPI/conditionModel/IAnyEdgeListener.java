package com.kuka.roboticsAPI.conditionModel;

import java.util.Date;

/** Called when a condition becomes true or false. */
public interface IAnyEdgeListener {
    void onAnyEdge(ConditionObserver observer, Date time, int missedEvents, boolean value);
}
