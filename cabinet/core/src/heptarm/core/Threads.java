package heptarm.core;

/** Ends threads. */
final class Threads {
    private static final long PATIENCE_MS = 2000;

    private Threads() {
    }

    /** Waits for a thread to end, for a while; never for the calling one. */
    static void join(Thread thread) {
        if (thread == null || thread == Thread.currentThread()) {
            return;
        }
        try {
            thread.join(PATIENCE_MS);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }
}
