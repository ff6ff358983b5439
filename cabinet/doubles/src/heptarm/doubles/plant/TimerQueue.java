package heptarm.doubles;

import java.util.ArrayList;
import java.util.Iterator;
import java.util.List;
import java.util.concurrent.locks.LockSupport;

/** Wakes threads that sleep for plant time; the plant calls {@link #tick} only when somebody's time has come. */
public final class TickHub {
    private static final class Sleeper {
        final Thread thread = Thread.currentThread();
        final long until;
        volatile boolean awake;

        Sleeper(long until) {
            this.until = until;
        }
    }

    private final Ring ring;
    private final List<Sleeper> sleepers = new ArrayList<>();

    public TickHub(Ring ring) {
        this.ring = ring;
    }

    /** Called by the plant's thread after a tick. */
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
        announce();
    }

    private void announce() {
        long earliest = Long.MAX_VALUE;
        for (Sleeper one : sleepers) {
            earliest = Math.min(earliest, one.until);
        }
        ring.wakeAt(earliest);
    }

    /** Sleeps until the plant's time has reached {@code nanos}. */
    void sleep(long nanos) throws InterruptedException {
        Sleeper me = new Sleeper(nanos);
        synchronized (this) {
            sleepers.add(me);
            announce();
        }
        // the tick may have passed while we got ready: then nobody will wake us for it
        while (!me.awake && ring.newest() * Ring.TICK_NS < nanos) {
            LockSupport.park(this);
            if (Thread.interrupted()) {
                forget(me);
                throw new InterruptedException();
            }
        }
        if (!me.awake) {
            forget(me);
        }
    }

    private synchronized void forget(Sleeper one) {
        sleepers.remove(one);
        announce();
    }
}
