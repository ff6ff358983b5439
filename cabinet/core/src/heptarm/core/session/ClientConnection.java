package heptarm.core;

import java.io.IOException;
import java.io.InputStream;
import java.io.OutputStream;
import java.net.Socket;
import java.util.ArrayDeque;

import heptarm.wire.Code;
import heptarm.wire.Goodbye;
import heptarm.wire.Message;
import heptarm.wire.Protocol;

/**
 * One connection: a reader thread that answers requests, and a writer thread with an outbox for everything else.
 *
 * <p>Whoever has an event or a state for the client leaves it in the outbox and goes on; a client that does not read can
 * therefore hold up nobody. Of states that pile up the oldest are dropped; a client that lets events pile up is closed.
 */
final class Client {
    private static final int MAX_EVENTS = 4096;
    private static final int MAX_STATES = 64;
    private static final long LINGER_MS = 500;
    private static final int SEQ = 10;
    /** What waits unread excuses no more silence than this [client's ns]: a reader that is stuck must not hide a dead client. */
    private static final double UNREAD_NS = 1e9;

    final int session;
    private final Server server;
    private final Socket socket;
    private final Handshake handshake;
    private final InputStream in;
    private final OutputStream out;

    private final Object outbox = new Object();
    private final ArrayDeque<byte[]> events = new ArrayDeque<byte[]>();
    private final ArrayDeque<byte[]> states = new ArrayDeque<byte[]>();
    private boolean writing;
    private volatile boolean ending;
    private long dropped;

    private int seq;
    private Thread reader;
    private Thread writer;
    private final long born;
    private volatile boolean gone;
    private volatile long heard;
    private long silenceBefore;
    private volatile long sent;
    private volatile long writeBegan;

    Client(Server server, Socket socket, int session) throws IOException {
        this.server = server;
        this.socket = socket;
        this.session = session;
        this.in = socket.getInputStream();
        this.out = socket.getOutputStream();
        this.handshake = new Handshake(server, this);
        this.born = server.clock.nanos();
        this.heard = born;
        this.sent = born;
    }

    void start() {
        reader = thread("ha-reader-" + session, new Runnable() {
            public void run() {
                readAll();
            }
        });
        writer = thread("ha-writer-" + session, new Runnable() {
            public void run() {
                writeAll();
            }
        });
        writer.start();
        reader.start();
    }

    private static Thread thread(String name, Runnable body) {
        Thread thread = new Thread(body, name);
        thread.setDaemon(true);
        return thread;
    }

    String name() {
        return handshake.name();
    }

    boolean isOpen() {
        return handshake.isOpen() && !ending && !gone;
    }

    /** Whether the client has not said who it is yet. */
    boolean isNew() {
        return !handshake.isOpen() && !ending;
    }

    /** Cabinet time at which the client connected. */
    long born() {
        return born;
    }

    /** Cabinet time of the last octets from the client. */
    long heard() {
        return heard;
    }

    /** For how long it has said nothing [ns], as two looks found: a machine held up may not have read its words yet. */
    long silence() {
        double excused = 0.0;
        try {
            excused = in.available() > 0 ? UNREAD_NS * server.clock.rate() : 0.0;
        } catch (IOException e) { // the reader finds out why
        }
        long before = silenceBefore;
        silenceBefore = server.clock.nanos() - heard - (long) excused;
        return Math.min(silenceBefore, before);
    }

    /** Cabinet time of the last frame to the client. */
    long sent() {
        return sent;
    }

    /** Cabinet time at which the write under way began; 0: none is under way. */
    long writeBegan() {
        return writeBegan;
    }

    String address() {
        return String.valueOf(socket.getRemoteSocketAddress());
    }

    // ------------------------------------------------------------------------------------------- reading

    private void readAll() {
        byte[] buffer = new byte[65536];
        int filled = 0;
        String why = "the connection was closed";
        try {
            while (!gone) {
                if (filled == buffer.length) {
                    byte[] larger = new byte[Math.min(buffer.length * 4, Protocol.HEADER + Protocol.MAX_BODY)];
                    System.arraycopy(buffer, 0, larger, 0, filled);
                    buffer = larger;
                }
                int count = in.read(buffer, filled, buffer.length - filled);
                if (count < 0) {
                    break;
                }
                heard = server.clock.nanos();
                filled += count;
                int used = frames(buffer, filled);
                filled -= used;
                if (used > 0 && filled > 0) {
                    System.arraycopy(buffer, used, buffer, 0, filled);
                }
            }
        } catch (IOException e) {
            why = "the connection broke (" + e.getMessage() + ")";
        } catch (RuntimeException e) {
            why = "an error in the cabinet application: " + e;
            server.log.error("serving " + address(), e);
        } finally {
            leave(why);
        }
    }

    /**
     * Handles all whole frames of the buffer; returns the octets used.
     *
     * <p>Of a connection that is ending all octets are read and thrown away: closing a socket with unread octets would
     * throw away the last words to the client.
     */
    private int frames(byte[] data, int filled) {
        int pos = 0;
        while (filled - pos >= Protocol.HEADER && !ending && !gone) {
            int length = int32(data, pos + 6);
            if (((data[pos] & 0xFF) << 8 | data[pos + 1] & 0xFF) != Protocol.MAGIC || length < 0 || length > Protocol.MAX_BODY) {
                goodbye(Code.BAD_FRAME, "it sent octets that are not a heptarm frame");
                return filled;
            }
            if (filled - pos < Protocol.HEADER + length) {
                break;
            }
            int version = data[pos + 2] & 0xFF;
            int type = (data[pos + 4] & 0xFF) << 8 | data[pos + 5] & 0xFF;
            long request = int32(data, pos + 14) & 0xFFFFFFFFL;
            if (handshake.isOpen()) {
                long stamp = (long) int32(data, pos + 18) << 32 | int32(data, pos + 22) & 0xFFFFFFFFL;
                server.dispatcher.handle(this, type, request, stamp, data, pos + Protocol.HEADER, length);
            } else {
                handshake.handle(version, type, data, pos + Protocol.HEADER, length);
            }
            pos += Protocol.HEADER + length;
        }
        return ending ? filled : pos;
    }

    private static int int32(byte[] data, int at) {
        return (data[at] & 0xFF) << 24 | (data[at + 1] & 0xFF) << 16 | (data[at + 2] & 0xFF) << 8 | data[at + 3] & 0xFF;
    }

    // ------------------------------------------------------------------------------------------- writing

    /** Sends an answer at once from the reader's thread if nothing is in the way, otherwise through the outbox. */
    void answer(Message message, long request) {
        byte[] frame = server.frame(message, request);
        boolean full = false;
        synchronized (outbox) {
            if (ending) {
                return;
            }
            if (writing || !events.isEmpty()) {
                full = events.size() >= MAX_EVENTS;
                if (!full) {
                    events.add(frame);
                    outbox.notify();
                    return;
                }
            }
            if (!full) {
                writing = true;
            }
        }
        if (full) {
            leave("it does not read its answers");
            return;
        }
        writeClaimed(frame);
    }

    /** Claims the connection: what others have for the client waits until {@link #writeClaimed}. False: it ends. */
    boolean claim() {
        synchronized (outbox) {
            if (writing || ending) {
                return false;
            }
            writing = true;
            return true;
        }
    }

    /** Writes a frame over the claimed connection and gives it back. */
    void writeClaimed(byte[] frame) {
        try {
            write(frame);
        } catch (IOException e) {
            leave("the connection broke (" + e.getMessage() + ")");
        } finally {
            synchronized (outbox) {
                writing = false;
                if (ending || !events.isEmpty() || !states.isEmpty()) {
                    outbox.notify(); // only then: waking the writer for nothing costs as much as the whole answer
                }
            }
        }
    }

    /** Leaves an event in the outbox. */
    void event(int type, byte[] body) {
        boolean full;
        synchronized (outbox) {
            full = events.size() >= MAX_EVENTS;
            if (!full && !ending) {
                events.add(server.frame(type, body));
                outbox.notify();
            }
        }
        if (full) {
            leave("it does not read its events");
        }
    }

    /** Leaves a state in the outbox; the oldest is dropped when too many wait. */
    void state(byte[] frame) {
        synchronized (outbox) {
            if (states.size() >= MAX_STATES) {
                states.poll();
                dropped++;
            }
            states.add(frame);
            outbox.notify();
        }
    }

    /** Says why and ends the connection when that is written. */
    void goodbye(int code, String text) {
        synchronized (outbox) {
            if (ending) {
                return;
            }
            events.add(server.frame(new Goodbye(code, text), 0));
            ending = true;
            outbox.notify();
        }
        server.retire(this, text);
    }

    /** Ends a connection that never became a session. */
    void refuse(int code, String text) {
        start(); // the writer sends the refusal, then closes
        handshake.refuse(code, text);
    }

    /** Everything in the outbox is written, then the connection ends. */
    void endAfterWriting() {
        synchronized (outbox) {
            ending = true;
            outbox.notify();
        }
    }

    private void writeAll() {
        try {
            while (!gone) {
                byte[] frame;
                synchronized (outbox) {
                    while (!gone && (writing || events.isEmpty() && states.isEmpty() && !ending)) {
                        outbox.wait();
                    }
                    frame = events.poll();
                    if (frame == null && ending) {
                        break;
                    }
                    if (frame == null) {
                        frame = states.poll();
                    }
                    writing = frame != null;
                }
                if (frame != null) {
                    write(frame);
                    synchronized (outbox) {
                        writing = false;
                    }
                }
            }
            linger();
            leave("the session was ended");
        } catch (IOException e) {
            leave("the connection broke (" + e.getMessage() + ")");
        } catch (InterruptedException e) {
            leave("the cabinet application ends");
        }
    }

    /** Says that nothing more comes, and waits a while for the client to end its side. */
    private void linger() throws IOException, InterruptedException {
        if (gone) {
            return;
        }
        socket.shutdownOutput();
        synchronized (outbox) {
            if (!gone) {
                outbox.wait(LINGER_MS);
            }
        }
    }

    private void write(byte[] frame) throws IOException {
        int number = seq++; // only the one that holds `writing` comes here
        frame[SEQ] = (byte) (number >>> 24);
        frame[SEQ + 1] = (byte) (number >>> 16);
        frame[SEQ + 2] = (byte) (number >>> 8);
        frame[SEQ + 3] = (byte) number;
        long now = server.clock.nanos();
        writeBegan = now;
        out.write(frame);
        sent = now;
        writeBegan = 0;
    }

    // ------------------------------------------------------------------------------------------- the end

    /** Ends the connection at once. */
    void leave(String why) {
        synchronized (outbox) {
            if (gone) {
                return;
            }
            gone = true;
            outbox.notifyAll();
        }
        try {
            socket.close();
        } catch (IOException e) {
            server.log.warn("closing " + address() + ": " + e);
        }
        server.left(this, why);
        if (dropped > 0) {
            server.log.info(dropped + " states were dropped for " + name() + ", who read too slowly");
        }
    }

    void join() {
        Threads.join(writer);
        leave("the cabinet application ends");
        Threads.join(reader);
    }
}
