package heptarm.fake;

import heptarm.core.Clock;

/** A clock that runs at a multiple of the machine's. */
final class ScaledClock implements Clock {
    private final long origin = System.nanoTime();
    private final double rate;

    ScaledClock(double rate) {
        this.rate = rate;
    }

    @Override
    public long nanos() {
        return (long) ((System.nanoTime() - origin) * rate);
    }

    @Override
    public long sleepUntil(long nanos) throws InterruptedException {
        long left = nanos - nanos();
        while (left > 0) {
            long wall = (long) Math.ceil(left / rate);
            Thread.sleep(wall / 1000000L, (int) (wall % 1000000L));
            left = nanos - nanos();
        }
        return nanos();
    }

    @Override
    public long sleepUntilReadable(long nanos) throws InterruptedException {
        return sleepUntil(nanos);
    }

    @Override
    public void awaitDue(long nanos) {
    }

    @Override
    public void hold(long nanos) {
    }

    @Override
    public void release() {
    }

    @Override
    public long stamp() {
        return nanos();
    }

    @Override
    public double rate() {
        return rate;
    }
}
