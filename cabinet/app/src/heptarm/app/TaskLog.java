package heptarm.app;

import com.kuka.task.ITaskLogger;

import heptarm.core.Log;

/** Writes the core's log to the cabinet's. */
final class TaskLog implements Log {
    private final ITaskLogger logger;
    private final boolean quiet;

    /** Quiet: the smartPAD shows warnings and errors only; the rest goes to the cabinet's log file. */
    TaskLog(ITaskLogger logger, boolean quiet) {
        this.logger = logger;
        this.quiet = quiet;
    }

    public void info(String text) {
        if (quiet) {
            logger.fine(text);
        } else {
            logger.info(text);
        }
    }

    public void warn(String text) {
        logger.warn(text);
    }

    public void error(String text, Throwable cause) {
        logger.error(text, cause);
    }
}
