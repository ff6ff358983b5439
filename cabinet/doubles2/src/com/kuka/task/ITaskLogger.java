package com.kuka.task;

/** Log of a task. */
public interface ITaskLogger {
    void error(String text);

    void info(String text);

    void warn(String text);
}
