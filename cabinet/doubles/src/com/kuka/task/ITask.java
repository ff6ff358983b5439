package com.kuka.task;

import java.util.Collection;

/** A task of the project: its class, and what runs of it. */
public interface ITask {
    /** Starts it once more. */
    ITaskInstance startInstance() throws InterruptedException;

    Collection<ITaskInstance> getInstances();

    /** Stops all that runs of it, and waits for their ends. */
    void stopAllInstances() throws InterruptedException;
}
