package com.kuka.connectivity.fastRobotInterface;

import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;

import com.kuka.connectivity.fastRobotInterface.FRIChannelInformation.FRIConnectionQuality;
import com.kuka.connectivity.fastRobotInterface.FRIChannelInformation.FRISessionState;

import heptarm.core.Clock;
import heptarm.core.Clocks;
import heptarm.doubles.plant.FriChannel;
import heptarm.doubles.runtime.ApplicationServices;
import heptarm.doubles.runtime.Station;

/** An FRI session, opened by its constructor. */
public class FRISession implements FriChannel {
    private static final double MILLI = 1e3;

    private final Station station = Station.current();
    private final List<IFRISessionListener> listeners = new CopyOnWriteArrayList<>();
    private final long number;
    private FRIChannelInformation information =
            new FRIChannelInformation(FRISessionState.IDLE, FRIConnectionQuality.POOR, 0, 0);
    private boolean closed;

    public FRISession(FRIConfiguration configuration) {
        number = station.plant.friOpen(configuration.settings(), this);
    }

    /** Waits until the quality of the connection suffices for an overlay. */
    public void await(long time, TimeUnit unit) throws TimeoutException {
        Clock clock = station.clock();
        long deadline = station.after(time, unit);
        try {
            synchronized (this) {
                while (information.getFRISessionState() == FRISessionState.IDLE
                        || information.getFRISessionState() == FRISessionState.MONITORING_WAIT) {
                    if (closed || !Clocks.await(this, clock, deadline)) {
                        throw new TimeoutException("no FRI client answered well enough within " + time + " " + unit + ": "
                                + information);
                    }
                }
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new IllegalStateException("interrupted while waiting for an FRI client", e);
        }
    }

    public void close() {
        synchronized (this) {
            if (closed) {
                return;
            }
            closed = true;
            notifyAll();
        }
        station.plant.friClose(number);
    }

    public synchronized FRIChannelInformation getFRIChannelInformation() {
        return information;
    }

    public void addFRISessionListener(IFRISessionListener listener) {
        listeners.add(listener);
    }

    /** Number of the session; for the simulation. */
    public long number() {
        return number;
    }

    @Override
    public void changed(int state, int quality, double latency, double jitter) {
        FRIChannelInformation now = new FRIChannelInformation(FRISessionState.values()[state],
                FRIConnectionQuality.values()[quality], MILLI * latency, MILLI * jitter);
        boolean other;
        synchronized (this) {
            other = now.getFRISessionState() != information.getFRISessionState();
            information = now;
            notifyAll();
        }
        for (IFRISessionListener one : listeners) {
            station.dispatch.execute(() -> tell(one, now, other));
        }
    }

    /** An exception in one listener of the application must not prevent calls of the others. */
    private static void tell(IFRISessionListener listener, FRIChannelInformation now, boolean other) {
        try {
            if (other) {
                listener.onFRISessionStateChanged(now);
            } else {
                listener.onFRIConnectionQualityChanged(now);
            }
        } catch (RuntimeException e) {
            ApplicationServices.current().logger.error("an FRI listener ended with an error", e);
        }
    }
}
