package com.kuka.common;

/** A thread was interrupted while it slept. */
public class ThreadInterruptedException extends RuntimeException {
    private static final long serialVersionUID = 1L;

    public ThreadInterruptedException(Throwable cause) {
        super("interrupted while sleeping", cause);
    }
}
