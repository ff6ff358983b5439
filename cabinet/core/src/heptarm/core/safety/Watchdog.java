package heptarm.core.safety;

import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.locks.LockSupport;

import heptarm.core.Clock;
import heptarm.core.FailureLog;
import heptarm.core.Log;
import heptarm.core.Threads;

/** Runs periodic checks in one thread: of connections, FRI sessions and the safety state. */
public final class Watchdog {
    /** Period of the thread [s]. */
    public static final double PERIOD = 0.01;
    /** It rests for so many periods at most while there is less to check. */
    private static final int LONGEST = 5;
    /** Least time between two rounds by the machine's clock [s]: a simulated second may be over in 10 ms. */
    private static final double LEAST = 5e-4;

    /** Pause after waking [ns]: the states of this moment are sampled and sent first. */
    private static final long PAUSE_NS = 400000L;

    private final Clock clock;
    private final Log log;
    private final List<Entry> entries = new CopyOnWriteArrayList<Entry>();
    private Thread thread;
    private volatile boolean closed;

    /** Something that is checked periodically. */
    public interface Check {
        /** Whether there is nothing to check at present. */
        boolean isIdle();

        void check();
    }

    private static final class Entry {
        final String name;
        final int rounds;
        final Check check;
        final FailureLog failures;
        int waited;

        Entry(String name, int rounds, Check check, Log log) {
            this.name = name;
            this.rounds = rounds;
            this.check = check;
            this.failures = new FailureLog(log);
        }
    }

    public Watchdog(Clock clock, Log log) {
        this.clock = clock;
        this.log = log;
    }

    /** Add a check that runs every few periods; the name appears in the log. */
    public void add(String name, int rounds, Check check) {
        entries.add(new Entry(name, rounds, check, log));
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
            while (!closed) {
                int rounds = next();
                clock.sleepUntil(clock.nanos() + (long) (rounds * PERIOD * 1e9)); // full periods, also after a delay
                LockSupport.parkNanos((long) (PAUSE_NS / clock.rate()));
                for (Entry one : entries) {
                    one.waited += rounds;
                    if (one.waited >= one.rounds) {
                        one.waited = 0;
                        run(one);
                    }
                }
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    /** Periods until the next round. */
    private int next() {
        int rounds = LONGEST;
        for (Entry one : entries) {
            if (!one.check.isIdle()) {
                rounds = Math.min(rounds, one.rounds);
            }
        }
        return Math.min(LONGEST, Math.max(rounds, (int) Math.ceil(LEAST * clock.rate() / PERIOD)));
    }

    private void run(Entry one) {
        try {
            one.check.check();
            one.failures.succeeded();
        } catch (Throwable e) { // also a method that this cabinet lacks: the other checks need this thread
            one.failures.failed("checking " + one.name, e);
        }
    }
}
