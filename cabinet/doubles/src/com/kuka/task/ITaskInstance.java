package com.kuka.task;

/** A task that runs. */
public interface ITaskInstance {
    boolean isRunning();

    /** Stops it, and waits for its end. */
    void stop() throws InterruptedException;
}
