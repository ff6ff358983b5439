package heptarm.core.session;

import java.io.IOException;
import java.io.InputStream;

import heptarm.core.Clock;

/**
 * For how long a client has been silent.
 *
 * <p>The reader's thread reports what comes, and the watchdog's thread asks.
 */
final class Silence {
    /** Most silence that unread bytes excuse [client's ns]: a stuck reader must not hide a dead client. */
    private static final double UNREAD_NS = 1e9;

    private final InputStream in;
    private final Clock clock;
    private long arrived;
    private long before;
    private volatile long lastReceived;

    Silence(InputStream in, Clock clock) {
        this.in = in;
        this.clock = clock;
        this.arrived = clock.nanos();
        this.lastReceived = arrived;
    }

    /** Bytes have come. They are a sign of life only where frames have no tags: anybody may have sent them. */
    void bytes(boolean tagged) {
        arrived = clock.nanos();
        if (!tagged) {
            lastReceived = arrived;
        }
    }

    /** The last bytes have completed a frame of the client. */
    void frame() {
        lastReceived = arrived;
    }

    /** Cabinet time of the last sign of life over TCP. */
    long lastReceived() {
        return lastReceived;
    }

    /** Silence over TCP [ns], whatever datagrams say. */
    long overTcp() {
        return clock.nanos() - lastReceived;
    }

    /**
     * Silence over TCP and UDP [ns], confirmed by two calls: a busy machine may not have read the client's bytes yet.
     *
     * @param datagram cabinet time at which the client sent its newest datagram
     */
    long confirmed(long datagram) {
        double excused = 0.0;
        try {
            excused = in.available() > 0 ? UNREAD_NS * clock.rate() : 0.0;
        } catch (IOException e) { // the reader reports it
        }
        long last = before;
        before = clock.nanos() - Math.max(lastReceived, datagram) - (long) excused;
        return Math.min(before, last);
    }
}
