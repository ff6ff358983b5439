package com.kuka.task;

import java.util.concurrent.TimeUnit;

/** Whether a function of a background task can be called. */
public interface ITaskFunctionMonitor {
    boolean isAvailable();

    /** Waits until it can be called; false if it cannot within the time. */
    boolean await(long time, TimeUnit unit) throws InterruptedException;
}
