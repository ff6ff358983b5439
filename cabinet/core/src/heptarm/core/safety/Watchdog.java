package heptarm.core.safety;

import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.locks.LockSupport;

import heptarm.core.Clock;
import heptarm.core.Log;
import heptarm.core.Threads;

/** Runs periodic checks in one thread: of connections, FRI sessions and the safety state. */
public final class Watchdog {
    /** Period of the thread [s]. */
    public static final double PERIOD = 0.01;

    /** Pause after waking [ns]: the states of this moment are sampled and sent first. */
    private static final long PAUSE_NS = 400000L;

    private final Clock clock;
    private final Log log;
    private final List<Entry> entries = new CopyOnWriteArrayList<Entry>();
    private Thread thread;
    private volatile boolean closed;

    /** Something that is checked periodically. */
    public interface Check {
        void check();
    }

    private static final class Entry {
        final String name;
        final int rounds;
        final Check check;
        boolean failing;

        Entry(String name, int rounds, Check check) {
            this.name = name;
            this.rounds = rounds;
            this.check = check;
        }
    }

    public Watchdog(Clock clock, Log log) {
        this.clock = clock;
        this.log = log;
    }

    /** Add a check that runs every few periods; the name appears in the log. */
    public void add(String name, int rounds, Check check) {
        entries.add(new Entry(name, rounds, check));
    }

    public void start() {
        thread = Threads.start("ha-watchdog", new Runnable() {
            public void run() {
                work();
            }
        });
    }

    public void close() {
        closed = true;
        Threads.end(thread);
    }

    private void work() {
        try {
            for (int round = 1; !closed; round++) {
                clock.sleepUntil(clock.nanos() + (long) (PERIOD * 1e9)); // a full period, also after a delay
                LockSupport.parkNanos((long) (PAUSE_NS / clock.rate()));
                for (Entry one : entries) {
                    if (round % one.rounds == 0) {
                        run(one);
                    }
                }
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private void run(Entry one) {
        try {
            one.check.check();
            one.failing = false;
        } catch (RuntimeException e) {
            if (!one.failing) { // once per failure: a cabinet's log is slow
                log.error("checking " + one.name, e);
            }
            one.failing = true;
        }
    }
}
