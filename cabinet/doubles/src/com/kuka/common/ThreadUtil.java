package com.kuka.common;

import heptarm.doubles.runtime.Station;

/** Sleeping without a checked exception. */
public final class ThreadUtil {
    private ThreadUtil() {
    }

    /** Sleeps for a time of the simulation; an interruption throws, and stays set. */
    public static void milliSleep(long millis) {
        try {
            Station.current().sleep(millis * 1000000L);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new ThreadInterruptedException(e);
        }
    }
}
