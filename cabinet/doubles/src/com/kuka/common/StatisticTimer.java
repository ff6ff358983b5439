package com.kuka.common;

/** Measures how long steps take. */
public class StatisticTimer {
    private static final double NANOS_PER_MILLI = 1e6;

    private long count;
    private double total;
    private double least = Double.POSITIVE_INFINITY;
    private double most;

    /** A running measurement of one step. */
    public final class OneTimeStep {
        private final long begun = System.nanoTime();

        OneTimeStep() {
        }

        public void end() {
            add((System.nanoTime() - begun) / NANOS_PER_MILLI);
        }
    }

    public OneTimeStep newTimeStep() {
        return new OneTimeStep();
    }

    private synchronized void add(double millis) {
        count++;
        total += millis;
        least = Math.min(least, millis);
        most = Math.max(most, millis);
    }

    /** Mean of all steps [ms]; 0 before the first has ended. */
    public synchronized double getMeanTimeMillis() {
        return count == 0 ? 0.0 : total / count;
    }

    @Override
    public synchronized String toString() {
        return count == 0 ? "no step has ended yet"
                : String.format("%d steps, mean %.3f ms, least %.3f ms, most %.3f ms", count, total / count, least, most);
    }
}
