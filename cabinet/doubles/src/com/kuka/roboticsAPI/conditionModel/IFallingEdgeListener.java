package com.kuka.roboticsAPI.conditionModel;

import java.util.Date;

/** Called when a condition becomes false. */
public interface IFallingEdgeListener {
    void onFallingEdge(ConditionObserver observer, Date time, int missedEvents);
}
