package heptarm.doubles.plant;

import java.util.concurrent.TimeUnit;

import heptarm.core.Clock;
import heptarm.core.Clocks;
import heptarm.doubles.runtime.Station;

/** What happens once; to wait for it takes simulation time. */
public final class Occurrence {
    private boolean happened;

    public synchronized void happen() {
        happened = true;
        notifyAll();
    }

    public synchronized boolean hasHappened() {
        return happened;
    }

    /** Waits for it; false if it does not happen within the time. */
    public synchronized boolean await(long time, TimeUnit unit) throws InterruptedException {
        Station station = Station.current();
        Clock clock = station.clock();
        long deadline = station.after(time, unit);
        while (!happened && Clocks.await(this, clock, deadline)) {
            continue; // notified, or the machine was faster than the simulation
        }
        return happened;
    }
}
