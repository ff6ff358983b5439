package heptarm.app;

import com.kuka.task.ITaskLogger;

import heptarm.core.Log;

/** The core's log on the cabinet's. */
final class TaskLog implements Log {
    private final ITaskLogger logger;
    private final boolean quiet;

    /** A quiet one shows warnings and errors only at the smartPAD; the rest goes to the cabinet's log file. */
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
