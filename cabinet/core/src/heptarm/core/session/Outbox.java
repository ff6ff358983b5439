package heptarm.core.session;

import java.io.IOException;
import java.util.ArrayDeque;

import heptarm.core.key.FrameTag;
import heptarm.wire.Goodbye;
import heptarm.wire.Message;
import heptarm.wire.StatesMissed;

/**
 * What waits to be sent to a client, who may write now, and whether the session still sends.
 *
 * <p>One thread at a time has the outbox: it alone writes to the socket, without the lock, while the others only queue. The
 * writer's thread takes it for each queued frame. An answer and a state that a single client receives are written by the
 * thread that made them if nobody has the outbox and nothing waits: to wake the writer costs as much as all the rest.
 *
 * <p>Events go before states. Too many states drop the oldest, and one report of their number goes to the client; too
 * many events end the connection. Nobody ever waits for the client but the writer and the thread that writes.
 *
 * <p>It goes through three stages: open; {@link #end ending}, in which what is queued and a Goodbye go out and nothing more is
 * taken; {@link #close closed}.
 */
final class Outbox {
    private static final int MAX_EVENTS = 4096;
    private static final int MAX_STATES = 256;
    /** A write that takes longer has waited for the client [ns]; for so long the sampler then does not write itself [ns]. */
    private static final long SLOW_WRITE_NS = 5000000L;
    private static final long UNHURRIED_NS = 10000000000L;

    private final SentFrames sent;
    private final FrameEncoder frames;
    private final Owner owner;
    private final ArrayDeque<byte[]> events = new ArrayDeque<byte[]>();
    private final ArrayDeque<byte[]> states = new ArrayDeque<byte[]>();
    private boolean taken;
    private volatile boolean ending;
    private volatile boolean closed;
    /** States that were due and were not sent, and those of them that the client has received a report of. */
    private long missed;
    private long reported;
    /** System time until which the sampler's thread does not write; only that thread uses it. */
    private long unhurried = Long.MIN_VALUE;

    /** Receives the end of the connection, called without the lock. */
    interface Owner {
        /** The client cannot be written to, or reads too slowly. */
        void leave(String why);
    }

    Outbox(SentFrames sent, FrameEncoder frames, Owner owner) {
        this.sent = sent;
        this.frames = frames;
        this.owner = owner;
    }

    /** Whether more than a Goodbye is sent. */
    boolean isOpen() {
        return !ending && !closed;
    }

    boolean isClosed() {
        return closed;
    }

    /** States that were due and were not sent. */
    synchronized long missed() {
        return missed;
    }

    // ------------------------------------------------------------------------------------------- taking

    /** Take the outbox for a first frame that goes before everything; returns false if the session has ended. */
    synchronized boolean take() {
        if (!isOpen()) {
            return false;
        }
        taken = true;
        return true;
    }

    /** Write a frame and give the outbox back, by the thread that has taken it; later frames have this tag. */
    void writeFirst(byte[] frame, FrameTag next) {
        try {
            sent.write(frame);
            sent.tagWith(next);
        } catch (IOException e) {
            owner.leave(broken(e));
        } finally {
            giveBack();
        }
    }

    private synchronized void giveBack() {
        taken = false;
        if (ending || isWaiting()) {
            notify(); // only then: waking the writer for nothing costs as much as a whole answer
        }
    }

    private boolean isWaiting() {
        return !events.isEmpty() || !states.isEmpty() || missed > reported;
    }

    // ------------------------------------------------------------------------------------------- sending

    /** Send an answer at once in this thread if the connection is free, otherwise after the events before it. */
    void answer(Message message, long request) {
        byte[] frame = frames.frame(message, request);
        boolean full;
        synchronized (this) {
            if (ending) {
                return;
            }
            boolean free = !taken && events.isEmpty();
            full = !free && events.size() >= MAX_EVENTS;
            if (!free && !full) {
                events.add(frame);
                notify();
                return;
            }
            taken |= free;
        }
        if (full) {
            owner.leave("it does not read its answers");
            return;
        }
        try {
            sent.write(frame);
        } catch (IOException e) {
            owner.leave(broken(e));
        } finally {
            giveBack();
        }
    }

    /** Queue an event. */
    void event(int type, byte[] body) {
        boolean full;
        synchronized (this) {
            full = events.size() >= MAX_EVENTS;
            if (!full && !ending) {
                events.add(frames.frame(type, body));
                notify();
            }
        }
        if (full) {
            owner.leave("it does not read its events");
        }
    }

    /** Queue a state; the oldest is dropped when too many wait. */
    synchronized void state(byte[] frame) {
        if (states.size() >= MAX_STATES) {
            states.poll();
            missed++;
        }
        states.add(frame);
        notify();
    }

    /** Send a state at once in the sampler's thread if the connection is free, and the last such write did not wait for the client. */
    void stateAtOnce(byte[] frame) {
        long began = System.nanoTime();
        synchronized (this) {
            if (taken || !isOpen() || began < unhurried || isWaiting()) {
                state(frame);
                return;
            }
            taken = true;
        }
        try {
            sent.write(frame);
        } catch (IOException e) { // the reader reports it
        } finally {
            giveBack();
        }
        long end = System.nanoTime();
        if (end - began > SLOW_WRITE_NS) {
            unhurried = end + UNHURRIED_NS;
        }
    }

    /** States that were due were not sampled. */
    synchronized void miss(long count) {
        missed += count;
        notify();
    }

    // ------------------------------------------------------------------------------------------- the writer's thread

    /** Write what waits, until the session has ended and all events are out, or the outbox is closed. */
    void writeAll() throws IOException, InterruptedException {
        byte[] frame = takeNext();
        while (frame != null) {
            sent.write(frame);
            synchronized (this) {
                taken = false;
            }
            frame = takeNext();
        }
    }

    /** Wait for a frame and take the outbox with it; null: nothing more is sent. */
    private synchronized byte[] takeNext() throws InterruptedException {
        while (!closed && (taken || !isWaiting() && !ending)) {
            wait();
        }
        if (closed) {
            return null;
        }
        byte[] frame = events.poll();
        if (frame == null && ending) {
            return null;
        }
        if (frame == null && missed > reported) { // one report for all, however many the client has missed
            frame = frames.frame(new StatesMissed(missed - reported), 0);
            reported = missed;
        } else if (frame == null) {
            frame = states.poll();
        }
        taken = frame != null;
        return frame;
    }

    // ------------------------------------------------------------------------------------------- the end

    /** Queue a Goodbye and take nothing more; returns false if that has happened already. */
    synchronized boolean end(int code, String text) {
        if (ending) {
            return false;
        }
        events.add(frames.frame(new Goodbye(code, text), 0));
        ending = true;
        notify();
        return true;
    }

    /** Write nothing more; returns false if that has happened already. */
    synchronized boolean close() {
        if (closed) {
            return false;
        }
        closed = true;
        notifyAll();
        return true;
    }

    /** Wait briefly until it is closed. */
    synchronized void awaitClosed(long milliseconds) throws InterruptedException {
        if (!closed) {
            wait(milliseconds);
        }
    }

    static String broken(IOException why) {
        return "the connection broke (" + why.getMessage() + ")";
    }
}
