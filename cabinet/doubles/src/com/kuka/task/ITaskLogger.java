package com.kuka.task;

/** Log of a task; {@code fine} does not reach the smartPAD. */
public interface ITaskLogger {
    void error(String text);

    void error(String text, Throwable cause);

    void fine(String text);

    void info(String text);

    void warn(String text);

    void warn(String text, Throwable cause);
}
