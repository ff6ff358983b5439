package com.kuka.task;

/** The tasks of the project. */
public interface ITaskManager {
    ITask getTask(Class<?> type);
}
