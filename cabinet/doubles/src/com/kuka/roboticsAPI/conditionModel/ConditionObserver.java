package com.kuka.roboticsAPI.conditionModel;

import java.util.Date;

import heptarm.doubles.plant.ConditionListener;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.Condition;

/** Monitors a condition, also without a motion. Created by an ObserverManager. */
public class ConditionObserver {
    /** Called on every edge. */
    interface Hearer {
        void edge(ConditionObserver observer, Date time, boolean value);
    }

    private final Station station;
    private final ICondition observed;
    private final Condition condition;
    private final boolean onEnable;
    private final Hearer hearer;
    private long watch;

    ConditionObserver(Station station, ICondition observed, Condition condition, boolean onEnable, Hearer hearer) {
        this.station = station;
        this.observed = observed;
        this.condition = condition;
        this.onEnable = onEnable;
        this.hearer = hearer;
    }

    public ICondition getCondition() {
        return observed;
    }

    public synchronized void enable() {
        if (watch == 0) {
            watch = station.plant.watch(condition, onEnable, new ConditionListener() {
                @Override
                public void changed(boolean holds) {
                    Date now = new Date();
                    station.dispatch.execute(() -> hear(now, holds));
                }
            });
        }
    }

    private void hear(Date time, boolean holds) {
        if (isEnabled()) {
            hearer.edge(this, time, holds);
        }
    }

    public synchronized void disable() {
        if (watch != 0) {
            station.plant.unwatch(watch);
            watch = 0;
        }
    }

    public synchronized boolean isEnabled() {
        return watch != 0;
    }
}
