package heptarm.app2;

import com.kuka.task.ITaskLogger;

import heptarm.core.Log;

/** Writes the core's log to the cabinet's. */
final class Sunrise2Log implements Log {
    private final ITaskLogger logger;

    Sunrise2Log(ITaskLogger logger) {
        this.logger = logger;
    }

    @Override
    public void info(String text) {
        logger.info(text);
    }

    @Override
    public void warn(String text) {
        logger.warn(text);
    }

    @Override
    public void error(String text, Throwable cause) {
        logger.error(text + ": " + cause);
    }
}
