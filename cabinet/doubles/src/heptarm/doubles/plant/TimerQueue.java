package heptarm.doubles.plant;

import java.util.ArrayList;
import java.util.Iterator;
import java.util.List;
import java.util.concurrent.atomic.AtomicBoolean;
import java.util.concurrent.locks.LockSupport;

import heptarm.doubles.seam.Seam;

/**
 * Threads that sleep in simulation time; the plant calls {@link #tick} only when at least one of them is due.
 *
 * <p>While the robot rests, the realtime loop of the plant sleeps here as well, until the first of them is due. Whoever changes
 * something that the plant must not miss wakes it by {@link #rouse}.
 */
public final class TimerQueue {
    private static final class Sleeper {
        final Thread thread = Thread.currentThread();
        final long until;
        volatile boolean awake;

        Sleeper(long until) {
            this.until = until;
        }
    }

    private final SharedState sharedState;
    private final List<Sleeper> sleepers = new ArrayList<>();
    private final AtomicBoolean roused = new AtomicBoolean();
    private volatile long earliest = Long.MAX_VALUE;
    /** The realtime loop while it sleeps; null: it ticks. */
    private volatile Thread resting;

    public TimerQueue(SharedState sharedState) {
        this.sharedState = sharedState;
        sharedState.onWrite(this::rouse);
    }

    /**
     * The realtime loop sleeps until the first sleeper is due, at the latest until a simulation time.
     *
     * @param latest [ns]
     * @return whether it was roused; also if that was before it came here
     */
    public boolean rest(long latest) {
        resting = Thread.currentThread();
        try {
            while (!roused.get()) {
                long left = sharedState.wallTime(Math.min(latest, earliest)) - System.nanoTime();
                if (left <= 0) {
                    break;
                }
                LockSupport.parkNanos(this, left);
            }
        } finally {
            resting = null;
        }
        return roused.getAndSet(false);
    }

    /** Ends {@link #rest}, or the next one if the realtime loop does not rest: something has changed. Any thread. */
    public void rouse() {
        roused.set(true);
        LockSupport.unpark(resting);
    }

    /** Called by the realtime thread of the plant after a tick. */
    public synchronized void tick(long nanos) {
        Iterator<Sleeper> all = sleepers.iterator();
        while (all.hasNext()) {
            Sleeper one = all.next();
            if (one.until <= nanos) {
                all.remove();
                one.awake = true;
                LockSupport.unpark(one.thread);
            }
        }
        publishNextWakeUp();
    }

    private void publishNextWakeUp() {
        long first = Long.MAX_VALUE;
        for (Sleeper one : sleepers) {
            first = Math.min(first, one.until);
        }
        boolean sooner = first < earliest;
        earliest = first;
        sharedState.setWakeTime(first);
        if (sooner) {
            LockSupport.unpark(resting); // to sleep less long
        }
    }

    /** Sleeps until the simulation time has reached {@code nanos}. */
    public void sleep(long nanos) throws InterruptedException {
        Sleeper own = new Sleeper(nanos);
        synchronized (this) {
            sleepers.add(own);
            publishNextWakeUp();
        }
        // the tick may have passed before the timer was registered: then no wake-up follows
        while (!own.awake && sharedState.newest() * Seam.TICK_NS < nanos) {
            LockSupport.park(this);
            if (Thread.interrupted()) {
                remove(own);
                throw new InterruptedException();
            }
        }
        if (!own.awake) {
            remove(own);
        }
    }

    private synchronized void remove(Sleeper one) {
        sleepers.remove(one);
        publishNextWakeUp();
    }
}
