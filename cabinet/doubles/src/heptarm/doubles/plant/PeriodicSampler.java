package heptarm.doubles;

import java.util.function.LongConsumer;

/** A thread that looks at the plant at equal intervals of its time. What it is woken for it sees as it was at that tick. */
public final class Sampling {
    private final Station station;
    private final long period;
    private final LongConsumer look;
    private final Thread thread;
    private volatile boolean stopped;

    /**
     * @param period [ns]
     * @param look called with the time since the first look [ns]
     */
    public Sampling(Station station, long period, LongConsumer look) {
        this.station = station;
        this.period = period;
        this.look = look;
        this.thread = new Thread(this::run, "sampling");
        thread.setDaemon(true);
    }

    public void start() {
        thread.start();
    }

    private void run() {
        PlantClock clock = new PlantClock();
        long first = station.ring.newest() * Ring.TICK_NS;
        long next = first;
        try {
            while (!stopped) {
                long now = clock.sleepUntil(next);
                look.accept(now - first);
                next += period;
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt(); // told to stop
        }
    }

    /** Ends it, and waits for that: nothing is looked at any more. */
    public void stop() {
        stopped = true;
        thread.interrupt();
        if (Thread.currentThread() == thread) {
            return;
        }
        try {
            thread.join();
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }
}
