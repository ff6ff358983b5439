package com.kuka.task;

/** A running instance of a task. */
public interface ITaskInstance {
    boolean isRunning();

    /** Stops it, and waits for its end. */
    void stop() throws InterruptedException;
}
