package heptarm.core;

/** Ends threads. */
final class Threads {
    private static final long PATIENCE_MS = 2000;
    private static final long PAUSE_MS = 100;

    private Threads() {
    }

    /** Lets a while pass. */
    static void pause() {
        try {
            Thread.sleep(PAUSE_MS);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    /** Interrupts a thread and waits for its end. */
    static void end(Thread thread) {
        if (thread != null) {
            thread.interrupt();
            join(thread);
        }
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
