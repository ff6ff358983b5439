package com.kuka.common;

/** Sleeping without a checked exception. */
public final class ThreadUtil {
    private ThreadUtil() {
    }

    public static void milliSleep(long millis) {
        try {
            Thread.sleep(millis);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }
}
