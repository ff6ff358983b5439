package com.kuka.roboticsAPI.conditionModel;

import java.util.Collection;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.TimeUnit;

import heptarm.doubles.motion.AbstractCondition;
import heptarm.doubles.plant.Occurrence;
import heptarm.doubles.runtime.ApplicationServices;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.Condition;

/** Monitors conditions for an application. */
public class ObserverManager {
    private final Station station = Station.current();
    private final Collection<ConditionObserver> observers = new CopyOnWriteArrayList<>();

    public ConditionObserver createConditionObserver(ICondition condition, NotificationType type, IRisingEdgeListener listener) {
        return make(condition, type, (observer, time, value) -> {
            if (value) {
                listener.onRisingEdge(observer, time, 0);
            }
        });
    }

    public ConditionObserver createConditionObserver(ICondition condition, NotificationType type, IFallingEdgeListener listener) {
        return make(condition, type, (observer, time, value) -> {
            if (!value) {
                listener.onFallingEdge(observer, time, 0);
            }
        });
    }

    public ConditionObserver createConditionObserver(ICondition condition, NotificationType type, IAnyEdgeListener listener) {
        return make(condition, type, (observer, time, value) -> listener.onAnyEdge(observer, time, 0, value));
    }

    private ConditionObserver make(ICondition condition, NotificationType type, ConditionObserver.Hearer hearer) {
        boolean onEnable = type == NotificationType.OnEnable || type == NotificationType.All;
        ConditionObserver made = new ConditionObserver(station, condition,
                AbstractCondition.translate(condition, station.robot), onEnable, (observer, time, value) -> {
                    try {
                        hearer.edge(observer, time, value);
                    } catch (RuntimeException e) {
                        ApplicationServices.current().logger.error("an observer's listener ended with an error", e);
                    }
                });
        observers.add(made);
        return made;
    }

    /** Waits until a condition is met. */
    public void waitFor(ICondition condition) {
        waitFor(condition, Long.MAX_VALUE, TimeUnit.DAYS);
    }

    /** Waits for a condition; false if it is not met within the time. */
    public boolean waitFor(ICondition condition, long time, TimeUnit unit) {
        Occurrence held = new Occurrence();
        Condition translated = AbstractCondition.translate(condition, station.robot);
        long watch = station.plant.watch(translated, true, holds -> {
            if (holds) {
                held.happen();
            }
        });
        try {
            return held.await(time, unit);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new IllegalStateException("interrupted while waiting for a condition", e);
        } finally {
            station.plant.unwatch(watch);
        }
    }

    public void removeConditionObserver(ConditionObserver observer) {
        observer.disable();
        observers.remove(observer);
    }

    public Collection<ConditionObserver> getRegisteredConditionObservers() {
        return java.util.List.copyOf(observers);
    }

    /** The application has ended; for the simulation. */
    public void close() {
        for (ConditionObserver one : observers) {
            removeConditionObserver(one);
        }
    }
}
