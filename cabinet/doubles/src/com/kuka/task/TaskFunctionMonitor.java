package com.kuka.task;

import heptarm.doubles.runtime.Station;

/** Creates monitors of task functions. */
public final class TaskFunctionMonitor {
    private TaskFunctionMonitor() {
    }

    /** A monitor of what {@code getTaskFunction} has returned. */
    public static ITaskFunctionMonitor create(Object function) {
        return Station.current().tasks.monitor(function);
    }
}
