package heptarm.core;

/** The machine's monotonic clock. */
public final class RealClock implements Clock {
    public long nanos() {
        return System.nanoTime();
    }

    public long sleepUntil(long nanos) throws InterruptedException {
        long left = nanos - System.nanoTime();
        while (left > 0) {
            Thread.sleep(left / 1000000L, (int) (left % 1000000L));
            left = nanos - System.nanoTime();
        }
        return System.nanoTime();
    }

    public long sleepUntilReadable(long nanos) throws InterruptedException {
        return sleepUntil(nanos);
    }

    public void awaitDue(long nanos) {
        // it has come
    }

    public void hold(long nanos) {
        // a real robot shows the present
    }

    public void release() {
        // see hold
    }

    public long stamp() {
        return nanos();
    }

    public double rate() {
        return 1.0;
    }
}
