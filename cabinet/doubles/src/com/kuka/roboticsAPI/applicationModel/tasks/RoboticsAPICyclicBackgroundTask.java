package com.kuka.roboticsAPI.applicationModel.tasks;

import java.util.concurrent.CancellationException;
import java.util.concurrent.ExecutionException;
import java.util.concurrent.Future;
import java.util.concurrent.FutureTask;
import java.util.concurrent.TimeUnit;

import heptarm.doubles.plant.PlantClock;

/** A background task that is called periodically, in simulated time. An exception in a cycle ends it. */
public abstract class RoboticsAPICyclicBackgroundTask extends RoboticsAPIBackgroundTask {
    private final FutureTask<Void> cycles = new FutureTask<>(this::cycle, null);
    private long initialDelay = -1;
    private long period;

    protected abstract void runCyclic() throws Exception;

    /** Sets delay and period of the cycles; called from {@link #initialize}. */
    protected void initializeCyclic(long delay, long every, TimeUnit unit, CycleBehavior behavior) {
        if (delay < 0 || every <= 0) {
            throw new IllegalArgumentException("initial delay must be at least 0 and period at least 1, got " + delay + " and " + every);
        }
        initialDelay = unit.toNanos(delay);
        period = unit.toNanos(every);
    }

    /** Cancelling it ends the task. */
    protected Future<?> getCyclicFuture() {
        return cycles;
    }

    /** Runs the cycles until the task is stopped. */
    @Override
    public void run() throws Exception {
        if (initialDelay < 0) {
            throw new IllegalStateException("initialize() of a cyclic task has to call initializeCyclic()");
        }
        try {
            cycles.run();
            cycles.get();
        } catch (CancellationException e) {
            Thread.interrupted(); // clear the flag of the handled interruption
        } catch (ExecutionException e) {
            throw e.getCause() instanceof Exception ? (Exception) e.getCause() : e;
        }
    }

    private void cycle() {
        PlantClock clock = new PlantClock();
        long next = clock.nanos() + initialDelay;
        try {
            while (!cycles.isDone()) {
                clock.sleepUntil(next);
                runCyclic();
                next = Math.max(next + period, clock.nanos());
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        } catch (RuntimeException e) {
            throw e;
        } catch (Exception e) {
            throw new IllegalStateException("a cycle ended with an error", e);
        }
    }
}
