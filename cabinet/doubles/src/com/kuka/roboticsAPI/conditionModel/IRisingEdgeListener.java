package com.kuka.roboticsAPI.conditionModel;

import java.util.Date;

/** Called when a condition becomes true. */
public interface IRisingEdgeListener {
    void onRisingEdge(ConditionObserver observer, Date time, int missedEvents);
}
