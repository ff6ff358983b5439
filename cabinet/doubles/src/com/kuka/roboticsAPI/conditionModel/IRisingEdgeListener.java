package com.kuka.roboticsAPI.conditionModel;

import java.util.Date;

/** Hears that a condition begins to hold. */
public interface IRisingEdgeListener {
    void onRisingEdge(ConditionObserver observer, Date time, int missedEvents);
}
