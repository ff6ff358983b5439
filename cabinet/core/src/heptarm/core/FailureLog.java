package heptarm.core;

/**
 * Logs the first of several failures in a row: a cabinet's log is slow, and nobody may fill it.
 *
 * <p>It serves the loops of threads that must not end: these catch errors, too, such as a method that an older cabinet lacks. So
 * a log that fails does not end them either.
 */
public final class FailureLog {
    private final Log log;
    private boolean isFailing;

    public FailureLog(Log log) {
        this.log = log;
    }

    /** It has failed. One thread. */
    public void failed(String what, Throwable cause) {
        boolean isNews = !isFailing;
        isFailing = true;
        if (isNews) {
            try {
                log.error(what, cause);
            } catch (Throwable e) { // the memory is used up, say
            }
        }
    }

    /** It works again. One thread. */
    public void succeeded() {
        isFailing = false;
    }
}
