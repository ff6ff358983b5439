package heptarm.doubles.plant;

import java.util.function.LongConsumer;

import heptarm.doubles.seam.Seam;

/**
 * Samples the plant at a fixed period of simulation time, whole ticks; each sample reads the state of exactly the tick that is due.
 * A thread that is later than the plant's record leaves samples out.
 */
public final class PeriodicSampler {
    private final long period;
    private final LongConsumer sample;
    private final Thread thread;
    private volatile boolean stopped;

    /**
     * @param period [ns]
     * @param sample called with the time since the first sample [ns]
     */
    public PeriodicSampler(long period, LongConsumer sample) {
        this.period = period;
        this.sample = sample;
        this.thread = new Thread(this::run, "sampling");
        thread.setDaemon(true);
    }

    public void start() {
        thread.start();
    }

    private void run() {
        PlantClock clock = new PlantClock();
        long first = clock.nanos() / Seam.TICK_NS * Seam.TICK_NS;
        long next = first;
        try {
            while (!stopped) {
                if (clock.sleepUntil(next) == next) { // else this thread is so late that the plant no longer has the tick's state
                    clock.hold(next);
                    sample.accept(next - first);
                }
                next += period;
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt(); // stop() was called
        }
    }

    /** Stops sampling and waits for the end of the thread. */
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
