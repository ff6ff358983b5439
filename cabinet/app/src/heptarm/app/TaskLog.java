package heptarm.app;

import com.kuka.task.ITaskLogger;

import heptarm.core.Log;

/** The core's log on the cabinet's. */
final class TaskLog implements Log {
    private final ITaskLogger logger;

    TaskLog(ITaskLogger logger) {
        this.logger = logger;
    }

    public void info(String text) {
        logger.info(text);
    }

    public void warn(String text) {
        logger.warn(text);
    }

    public void error(String text, Throwable cause) {
        logger.error(text, cause);
    }
}
