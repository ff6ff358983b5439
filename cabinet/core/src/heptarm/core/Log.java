package heptarm.core;

/** Where the core says what it does; never called on a hot path. */
public interface Log {
    void info(String text);

    void warn(String text);

    void error(String text, Throwable cause);
}
