package heptarm.doubles.plant;

import java.util.ArrayList;
import java.util.Iterator;
import java.util.List;
import java.util.concurrent.locks.LockSupport;

import heptarm.doubles.seam.Seam;

/** Threads that sleep in simulation time; the plant calls {@link #tick} only when at least one of them is due. */
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

    public TimerQueue(SharedState sharedState) {
        this.sharedState = sharedState;
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
        long earliest = Long.MAX_VALUE;
        for (Sleeper one : sleepers) {
            earliest = Math.min(earliest, one.until);
        }
        sharedState.setWakeTime(earliest);
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
