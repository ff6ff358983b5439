package com.kuka.task;

import java.util.concurrent.TimeUnit;

/** Whether a function of a background task can be called. */
public interface ITaskFunctionMonitor {
    boolean isAvailable();

    /** Waits until it can be called; false: the time has passed. */
    boolean await(long time, TimeUnit unit) throws InterruptedException;
}
