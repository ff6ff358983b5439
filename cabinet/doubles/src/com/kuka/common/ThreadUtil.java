package com.kuka.common;

import heptarm.doubles.runtime.Station;

/** Sleeping without a checked exception. */
public final class ThreadUtil {
    private ThreadUtil() {
    }

    /** Sleeps in simulated time; an interruption throws and leaves the interrupt flag set. */
    public static void milliSleep(long millis) {
        try {
            Station.current().sleep(millis * 1000000L);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new ThreadInterruptedException(e);
        }
    }
}
