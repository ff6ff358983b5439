package com.kuka.task;

import java.util.Collection;

/** A task of the project: its class, and its running instances. */
public interface ITask {
    /** Starts another instance. */
    ITaskInstance startInstance() throws InterruptedException;

    Collection<ITaskInstance> getInstances();

    /** Stops all instances, and waits for their ends. */
    void stopAllInstances() throws InterruptedException;
}
