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
 * <p>While the robot rests, the realtime loop of the plant waits here as well, see {@link #rest}. Then each thread wakes by itself,
 * when its tick is due, and publishes the ticks until then: to be woken by the loop would cost two wakings instead of one. A change
 * that the plant must not miss ends the rest by {@link #rouse}.
 */
public final class TimerQueue {
    private static final class Sleeper {
        final Thread thread = Thread.currentThread();
        final long until;
        volatile boolean awake;
        /** Whether it wakes by itself. */
        volatile boolean timed;

        Sleeper(long until) {
            this.until = until;
        }
    }

    /** A state is at most so many ticks old at rest: the clocks of the threads run ahead of it no further than that. */
    static final int STRIDE = 50;
    /**
     * A thread that is awake before its tick is due spins for so long at most [ns]; before that it sleeps. To wake takes 40 us; to
     * spin longer takes time from others on its processor, and has more of it taken by the host of a virtual machine.
     */
    private static final long SPIN_NS = 100000L;

    private final SharedState sharedState;
    private final List<Sleeper> sleepers = new ArrayList<>();
    private final AtomicBoolean roused = new AtomicBoolean();
    /** The realtime loop while it sleeps; null: it ticks. */
    private volatile Thread resting;
    /** Tick at which the rest ends. */
    private volatile long last;

    public TimerQueue(SharedState sharedState) {
        this.sharedState = sharedState;
        sharedState.onWrite(this::rouse);
    }

    /**
     * Lets the time pass while the robot rests: repeats its last state tick by tick, and wakes the sleepers. Called by the realtime
     * loop; Python takes no part in it, so that a resting robot costs little.
     *
     * @param latest simulation time at which this ends [ns]
     * @return whether it was roused, also if that was before it came here; then the next tick has to be simulated
     */
    public boolean rest(long latest) {
        last = latest / Seam.TICK_NS;
        beginRest();
        try {
            while (sharedState.computed() < last) {
                boolean changed = roused.get();
                long left = sharedState.wallTime(Math.min(sharedState.computed() + STRIDE, last)) - System.nanoTime();
                if (left > 0 && !changed) {
                    LockSupport.parkNanos(this, left);
                    continue;
                }
                repeat(0);
                if (changed) {
                    break; // sleepers wait for the next tick, which shows the change
                }
            }
        } finally {
            endRest();
        }
        return roused.getAndSet(false);
    }

    private synchronized void beginRest() {
        resting = Thread.currentThread();
        for (Sleeper one : sleepers) {
            if (!one.timed) {
                LockSupport.unpark(one.thread);
            }
        }
    }

    private synchronized void endRest() {
        resting = null;
    }

    /** Publishes the ticks that are due by now, and the next one if it is so near [ns], as long as the robot rests. */
    private synchronized void repeat(long ahead) {
        if (resting != null) {
            sharedState.repeat(last, sharedState.computed() + 2 * STRIDE, ahead);
            tick(sharedState.computed() * Seam.TICK_NS);
        }
    }

    /** The first tick at or after a simulation time. */
    private static long ticks(long nanos) {
        return nanos / Seam.TICK_NS + (nanos % Seam.TICK_NS == 0 ? 0 : 1);
    }

    /** Ends {@link #rest}, or the next one if the realtime loop does not rest: something has changed. Any thread. */
    public void rouse() {
        roused.set(true);
        LockSupport.unpark(resting);
    }

    /** Called by the realtime thread of the plant when a tick is computed, which may be before it is due: see {@link #awaitDue}. */
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
        sharedState.setWakeTime(first);
    }

    /** Sleeps until the simulation time has reached {@code nanos}. */
    public void sleep(long nanos) throws InterruptedException {
        sleepUntilComputed(nanos);
        awaitDue(ticks(nanos));
    }

    /** Sleeps until the tick of a simulation time is computed; it may not be due yet, see {@link #awaitDue}. */
    void sleepUntilComputed(long nanos) throws InterruptedException {
        Sleeper own = new Sleeper(nanos);
        synchronized (this) {
            sleepers.add(own);
            publishNextWakeUp();
        }
        // the tick may have passed before the timer was registered: then no wake-up follows
        while (!own.awake && sharedState.computed() * Seam.TICK_NS < nanos) {
            await(own);
            if (Thread.interrupted()) {
                remove(own);
                throw new InterruptedException();
            }
        }
        if (!own.awake) {
            remove(own);
        }
    }

    /** Waits for the plant's wake-up, or while the robot rests until the tick is nearly due; may return sooner. */
    private void await(Sleeper own) {
        own.timed = false; // before the look, so that a rest that begins just now ends the sleep
        own.timed = resting != null && !roused.get() && ticks(own.until) <= last;
        if (!own.timed) {
            LockSupport.park(this);
        } else if (!parkUntilNearly(ticks(own.until))) {
            repeat(SPIN_NS);
        }
    }

    /** Sleeps unless a tick is due within {@link #SPIN_NS}; returns whether it did. */
    private boolean parkUntilNearly(long tick) {
        long left = sharedState.wallTime(tick) - System.nanoTime() - SPIN_NS;
        if (left > 0) {
            LockSupport.parkNanos(this, left);
            return true;
        }
        Thread.onSpinWait();
        return false;
    }

    /** Waits until a tick that is computed is due: the plant wakes the sleepers before, since waking takes a while, too. */
    public void awaitDue(long tick) throws InterruptedException {
        while (sharedState.newest() < tick) {
            parkUntilNearly(tick);
            if (Thread.interrupted()) {
                throw new InterruptedException();
            }
        }
    }

    private synchronized void remove(Sleeper one) {
        sleepers.remove(one);
        publishNextWakeUp();
    }
}
