package com.kuka.task;

import heptarm.doubles.runtime.Station;

/** Makes monitors of task functions. */
public final class TaskFunctionMonitor {
    private TaskFunctionMonitor() {
    }

    /** Monitors what {@code getTaskFunction} has returned. */
    public static ITaskFunctionMonitor create(Object function) {
        return Station.current().tasks.monitor(function);
    }
}
