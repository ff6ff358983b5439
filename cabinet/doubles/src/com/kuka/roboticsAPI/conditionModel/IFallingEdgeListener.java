package com.kuka.roboticsAPI.conditionModel;

import java.util.Date;

/** Hears that a condition ceases to hold. */
public interface IFallingEdgeListener {
    void onFallingEdge(ConditionObserver observer, Date time, int missedEvents);
}
