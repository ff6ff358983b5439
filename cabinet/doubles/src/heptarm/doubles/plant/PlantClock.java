package heptarm.doubles.plant;

import java.util.concurrent.atomic.AtomicLong;

import heptarm.core.Clock;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.Seam;

/** Simulation time as the clock of the cabinet. A thread that it wakes reads the robot state of the tick it was woken for. */
public final class PlantClock implements Clock {
    private static final long AHEAD_NS = TimerQueue.STRIDE * Seam.TICK_NS;
    private static final double FREE_RUN = 100.0;

    private final SharedState sharedState;
    private final TimerQueue timers;
    private final AtomicLong latest = new AtomicLong();

    public PlantClock() {
        Station station = Station.current();
        sharedState = station.sharedState;
        timers = station.timers;
    }

    @Override
    public long nanos() {
        double rate = sharedState.rate();
        long newest = sharedState.newest() * Seam.TICK_NS;
        long now = newest;
        if (rate > 0.0) {
            long wall = (long) ((System.nanoTime() - sharedState.anchor()) * rate);
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
        long tick = tick(nanos);
        sleepUntilComputed(tick);
        timers.awaitDue(tick);
        return sharedState.view(tick) * Seam.TICK_NS;
    }

    @Override
    public long sleepUntilReadable(long nanos) throws InterruptedException {
        long tick = tick(nanos);
        sleepUntilComputed(tick);
        return sharedState.view(tick) * Seam.TICK_NS;
    }

    @Override
    public void awaitDue(long nanos) throws InterruptedException {
        timers.awaitDue(tick(nanos));
    }

    private void sleepUntilComputed(long tick) throws InterruptedException {
        if (sharedState.computed() < tick) {
            timers.sleepUntilComputed(tick * Seam.TICK_NS);
        } else if (Thread.interrupted()) {
            throw new InterruptedException();
        }
    }

    private static long tick(long nanos) {
        return Math.max(0, (nanos + Seam.TICK_NS - 1) / Seam.TICK_NS);
    }

    @Override
    public void hold(long nanos) {
        sharedState.hold(nanos / Seam.TICK_NS);
    }

    @Override
    public void release() {
        sharedState.release();
    }

    @Override
    public long stamp() {
        long held = sharedState.held();
        return held < 0 ? nanos() : held * Seam.TICK_NS;
    }

    @Override
    public double rate() {
        double rate = sharedState.rate();
        return rate > 0.0 ? rate : FREE_RUN;
    }
}
