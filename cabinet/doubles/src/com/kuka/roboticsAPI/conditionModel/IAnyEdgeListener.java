package com.kuka.roboticsAPI.conditionModel;

import java.util.Date;

/** Hears that a condition begins or ceases to hold. */
public interface IAnyEdgeListener {
    void onAnyEdge(ConditionObserver observer, Date time, int missedEvents, boolean value);
}
