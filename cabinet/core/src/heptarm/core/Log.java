package heptarm.core;

/** Log of the core; never called on a hot path. */
public interface Log {
    void info(String text);

    void warn(String text);

    void error(String text, Throwable cause);
}
