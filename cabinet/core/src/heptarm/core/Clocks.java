package heptarm.core;

import java.util.Iterator;
import java.util.ServiceLoader;
import java.util.concurrent.TimeUnit;

/** Finds the clock, a provider on the class path (the virtual cabinet's), otherwise the machine's; and waits by it. */
public final class Clocks {
    private Clocks() {
    }

    public static Clock find() {
        Iterator<Clock> found = ServiceLoader.load(Clock.class, Clocks.class.getClassLoader()).iterator();
        return found.hasNext() ? found.next() : new RealClock();
    }

    /** The cabinet time [ns] after so many seconds of a client from now: they do not pass faster in a simulation. */
    public static long afterClientSeconds(Clock clock, double seconds) {
        return clock.nanos() + (long) (seconds * clock.rate() * 1e9);
    }

    /**
     * Under the lock of the monitor: waits until it is notified, or until a cabinet time.
     *
     * @return whether the time has not come yet; then the caller checks what it waits for, and waits again
     */
    public static boolean await(Object monitor, Clock clock, long until) throws InterruptedException {
        long left = until - clock.nanos();
        if (left > 0) {
            TimeUnit.NANOSECONDS.timedWait(monitor, Math.max(1L, (long) (left / clock.rate())));
        }
        return left > 0;
    }
}
