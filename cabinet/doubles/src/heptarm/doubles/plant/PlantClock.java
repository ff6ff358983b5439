package heptarm.doubles;

import java.util.concurrent.atomic.AtomicLong;

import heptarm.core.Clock;

/** The plant's time as the cabinet's clock. A thread that it wakes sees the robot as it was at the tick it was woken for. */
public final class PlantClock implements Clock {
    private static final long AHEAD_NS = 20 * Ring.TICK_NS;
    private static final double FREE_RUN = 100.0;

    private final Ring ring;
    private final TickHub hub;
    private final AtomicLong latest = new AtomicLong();

    public PlantClock() {
        Station station = Station.current();
        ring = station.ring;
        hub = station.hub;
    }

    @Override
    public long nanos() {
        double rate = ring.rate();
        long newest = ring.newest() * Ring.TICK_NS;
        long now = newest;
        if (rate > 0.0) {
            long wall = (long) ((System.nanoTime() - ring.anchor()) * rate);
            now = Math.max(newest, Math.min(wall, newest + AHEAD_NS));
        }
        long before = latest.get();
        while (now > before && !latest.compareAndSet(before, now)) {
            before = latest.get();
        }
        return Math.max(now, before);
    }

    @Override
    public long sleepUntil(long nanos) throws InterruptedException {
        long tick = Math.max(0, (nanos + Ring.TICK_NS - 1) / Ring.TICK_NS);
        if (ring.newest() < tick) {
            hub.sleep(tick * Ring.TICK_NS);
        } else if (Thread.interrupted()) {
            throw new InterruptedException();
        }
        return ring.view(tick) * Ring.TICK_NS;
    }

    @Override
    public double rate() {
        double rate = ring.rate();
        return rate > 0.0 ? rate : FREE_RUN;
    }
}
