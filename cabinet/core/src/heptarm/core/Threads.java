package heptarm.core;

/** Starts and ends the threads of the core. */
public final class Threads {
    private static final long PATIENCE_MS = 2000;
    private static final long PAUSE_MS = 100;

    private Threads() {
    }

    /** Starts a daemon thread. */
    public static Thread start(String name, Runnable body) {
        Thread thread = new Thread(body, name);
        thread.setDaemon(true);
        thread.start();
        return thread;
    }

    /** Pauses the calling thread briefly. */
    public static void pause() {
        try {
            Thread.sleep(PAUSE_MS);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    /** Interrupts a thread and waits for its end. */
    public static void end(Thread thread) {
        if (thread != null) {
            thread.interrupt();
            join(thread);
        }
    }

    /** Waits up to two seconds for a thread to end; never for the calling one. */
    public static void join(Thread thread) {
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
