package heptarm.core.session;

import java.io.IOException;
import java.io.InputStream;
import java.io.OutputStream;
import java.net.Socket;
import java.util.ArrayDeque;

import heptarm.core.Clock;
import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.core.key.FrameTag;
import heptarm.core.key.KeyExchange;
import heptarm.core.state.StateSampler;
import heptarm.wire.Code;
import heptarm.wire.DatagramStatistics;
import heptarm.wire.DatagramToken;
import heptarm.wire.Goodbye;
import heptarm.wire.Message;
import heptarm.wire.Messages;
import heptarm.wire.Protocol;
import heptarm.wire.State;
import heptarm.wire.StatesMissed;
import heptarm.wire.Welcome;

/**
 * One connection: a reader thread that answers requests, and a writer thread with an outbox for everything else.
 *
 * <p>Events and states go into the outbox without waiting, so a client that does not read delays nobody. When states pile up,
 * the oldest are dropped; a connection whose events pile up is closed.
 */
final class ClientConnection implements ControlAuthority.Controller, StateSampler.Subscriber, DatagramPeer.Receiver {
    private static final int BUFFER = 16384;
    private static final int MAX_EVENTS = 4096;
    private static final int MAX_STATES = 256;
    private static final long LINGER_MS = 500;
    /** A write that takes longer has waited for the client [ns]; for so long the sampler then does not write itself [ns]. */
    private static final long SLOW_WRITE_NS = 5000000L;
    private static final long UNHURRIED_NS = 10000000000L;
    /** Most silence that unread bytes excuse [client's ns]: a stuck reader must not hide a dead client. */
    private static final double UNREAD_NS = 1e9;

    private final int session;
    private final Socket socket;
    private final Handshake handshake;
    private final CabinetIdentity identity;
    private final RequestDispatcher dispatcher;
    private final Owner owner;
    private final FrameEncoder frames;
    private final DatagramPort port;
    private final Clock clock;
    private final Log log;
    private final InputStream in;
    private final OutputStream out;

    private final Object outbox = new Object();
    private final ArrayDeque<byte[]> events = new ArrayDeque<byte[]>();
    private final ArrayDeque<byte[]> states = new ArrayDeque<byte[]>();
    private boolean writing;
    /** System time until which the sampler's thread does not write; only that thread uses it. */
    private long unhurried = Long.MIN_VALUE;
    private volatile boolean open;
    private volatile boolean ending;
    /** States that were due and were not sent, and those of them that the client has received a report of. */
    private long missed;
    private long reported;

    private int seq;
    private int expected;
    /** Tags of the client's frames and of ours; null without a key. */
    private FrameTag theirs;
    private FrameTag ours;
    private byte[] tagged = new byte[0];
    private byte[] unread;
    private long arrived;
    private Thread reader;
    private Thread writer;
    private volatile boolean gone;
    private volatile long lastReceived;
    private long silenceBefore;
    private volatile DatagramPeer datagrams;
    private final Object requests = new Object();
    /** Newest request over TCP, and newest one that a datagram anticipated. */
    private long lastRequest;
    private long anticipated;
    private volatile long lastSent;
    private volatile long writeBegan;

    /** Receives the end of a connection. */
    interface Owner {
        /** The client receives no more states and events, and controls nothing any more; code: of the Goodbye, 0: none. */
        void ending(ClientConnection client, int code, String why);

        /** The connection is closed. */
        void closed(ClientConnection client, String why);
    }

    ClientConnection(Newcomer newcomer, int session, CabinetIdentity identity, RequestDispatcher dispatcher, Owner owner,
            FrameEncoder frames, DatagramPort port, Clock clock, Log log) throws IOException {
        this.identity = identity;
        this.dispatcher = dispatcher;
        this.owner = owner;
        this.frames = frames;
        this.port = port;
        this.clock = clock;
        this.log = log;
        this.socket = newcomer.socket;
        this.session = session;
        this.in = socket.getInputStream();
        this.out = socket.getOutputStream();
        this.handshake = newcomer.handshake;
        this.expected = newcomer.received();
        this.seq = newcomer.sent();
        this.unread = newcomer.unread();
        this.lastReceived = clock.nanos();
        this.lastSent = lastReceived;
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

    public String name() {
        return handshake.name();
    }

    public int session() {
        return session;
    }

    public boolean isOpen() {
        return open && !ending && !gone;
    }

    /** Cabinet time of the last bytes from the client over TCP. */
    long lastReceived() {
        return lastReceived;
    }

    /** Silence of the client over TCP [ns], whatever its datagrams say. */
    long silenceOverTcp() {
        return clock.nanos() - lastReceived;
    }

    /** Silence of the client [ns], confirmed by two calls: a busy machine may not have read its bytes yet. */
    long silence() {
        double excused = 0.0;
        try {
            excused = in.available() > 0 ? UNREAD_NS * clock.rate() : 0.0;
        } catch (IOException e) { // the reader reports it
        }
        long before = silenceBefore;
        DatagramPeer peer = datagrams;
        long heard = peer == null ? lastReceived : Math.max(lastReceived, peer.heard());
        silenceBefore = clock.nanos() - heard - (long) excused;
        return Math.min(silenceBefore, before);
    }

    /** Cabinet time of the last frame to the client. */
    long lastSent() {
        return lastSent;
    }

    /** Cabinet time at which the current write began; 0: none. */
    long writeBegan() {
        return writeBegan;
    }

    /** Its address without the port. */
    String host() {
        return socket.getInetAddress().getHostAddress();
    }

    String address() {
        return String.valueOf(socket.getRemoteSocketAddress());
    }

    // ------------------------------------------------------------------------------------------- reading

    private void readAll() {
        byte[] buffer = new byte[BUFFER];
        System.arraycopy(unread, 0, buffer, 0, unread.length);
        int filled = unread.length;
        unread = null;
        String why = "the connection was closed";
        try {
            welcome();
            arrived = lastReceived;
            filled -= handleFrames(buffer, filled); // a client without a key may say more than Hello at once
            while (!gone) {
                if (filled == buffer.length) {
                    byte[] larger = new byte[Math.min(buffer.length * 4, Protocol.HEADER + Protocol.MAX_BODY + Protocol.TAG)];
                    System.arraycopy(buffer, 0, larger, 0, filled);
                    buffer = larger;
                }
                int count = in.read(buffer, filled, buffer.length - filled);
                if (count < 0) {
                    break;
                }
                arrived = clock.nanos();
                if (theirs == null) {
                    lastReceived = arrived; // with a key only whole frames of the client are a sign of life
                }
                filled += count;
                int used = handleFrames(buffer, filled);
                filled -= used;
                if (used > 0 && filled > 0) {
                    System.arraycopy(buffer, used, buffer, 0, filled);
                }
            }
        } catch (IOException e) {
            why = "the connection broke (" + e.getMessage() + ")";
        } catch (RuntimeException e) {
            why = "an error in the cabinet application: " + e;
            log.error("serving " + address(), e);
        } finally {
            leave(why);
        }
    }

    /**
     * Handle all complete frames of the buffer; returns the bytes used.
     *
     * <p>A connection that is ending reads and discards all bytes: closing a socket with unread bytes would discard the last
     * frames to the client.
     */
    private int handleFrames(byte[] data, int filled) {
        int pos = 0;
        while (filled - pos >= Protocol.HEADER && !ending && !gone) {
            int length = FrameEncoder.getInt(data, pos + 6);
            if (((data[pos] & 0xFF) << 8 | data[pos + 1] & 0xFF) != Protocol.MAGIC || length < 0 || length > Protocol.MAX_BODY) {
                goodbye(Code.BAD_FRAME, "it sent bytes that are not a heptarm frame");
                return filled;
            }
            int rest = pos + Protocol.HEADER + length;
            int end = theirs == null ? rest : rest + Protocol.TAG;
            if (data[pos + FrameEncoder.FLAGS] != (theirs == null ? 0 : FrameEncoder.TAGGED)) {
                forged(theirs == null ? "a frame has flags that this session does not have" : "a frame has no tag");
                return filled;
            }
            if (filled < end) {
                break;
            }
            if (theirs != null && !theirs.fits(data, pos, rest)) {
                forged("a frame has a wrong tag");
                return filled;
            }
            int type = (data[pos + 4] & 0xFF) << 8 | data[pos + 5] & 0xFF;
            long request = FrameEncoder.getInt(data, pos + 14) & 0xFFFFFFFFL;
            if (FrameEncoder.getInt(data, pos + FrameEncoder.SEQUENCE) != expected) {
                forged("frame " + (expected & 0xFFFFFFFFL) + " was expected, frame "
                        + (FrameEncoder.getInt(data, pos + FrameEncoder.SEQUENCE) & 0xFFFFFFFFL) + " came");
                return filled;
            }
            expected++;
            if (expected == 0 && theirs != null) {
                theirs.beginRound();
            }
            lastReceived = arrived;
            if ((data[pos + 2] & 0xFF) != Protocol.MAJOR) {
                goodbye(Code.WRONG_VERSION, "a frame has protocol version " + (data[pos + 2] & 0xFF) + ", this cabinet has "
                        + Protocol.MAJOR);
                return filled;
            }
            long stamp = (long) FrameEncoder.getInt(data, pos + 18) << 32 | FrameEncoder.getInt(data, pos + 22) & 0xFFFFFFFFL;
            synchronized (requests) { // a datagram that anticipates this request is done first, or never
                lastRequest = Messages.isRequest(type) ? request : lastRequest;
            }
            dispatcher.handle(this, type, request, stamp, data, pos + Protocol.HEADER, length);
            pos = end;
        }
        return ending ? filled : pos;
    }

    /** End a session in which a frame is not the next one of the client. */
    private void forged(String what) {
        goodbye(Code.FORGED_FRAME, what + ": it was forged, changed, repeated, reordered or lost in transit");
    }

    // ------------------------------------------------------------------------------------------- datagrams

    /** Open datagrams, or open them again with another token. */
    DatagramToken openDatagrams() throws CommandRejected {
        if (!port.isOpen()) {
            throw new CommandRejected(Code.UNSUPPORTED, "this cabinet has no UDP port: the process data heptarm.datagrams is 0, or another"
                    + " program has taken the port; the smartPAD shows which");
        }
        byte[] token = Handshake.token();
        byte[] secret = handshake.datagramSecret(token);
        DatagramPeer peer = new DatagramPeer(session, socket.getInetAddress(), port, KeyExchange.clientDatagramTag(secret, token),
                KeyExchange.cabinetDatagramTag(secret, token), frames, clock, this);
        synchronized (outbox) {
            if (gone) {
                throw new CommandRejected(Code.UNSUPPORTED, "the connection has ended; connect again");
            }
            datagrams = peer;
            port.add(peer);
        }
        return new DatagramToken(token);
    }

    /** What was counted of the datagrams; all 0 if they are not open. */
    DatagramStatistics datagramCounts() {
        DatagramPeer peer = datagrams;
        return peer == null ? new DatagramStatistics(0, 0, 0, 0, 0, port.strange(), 0) : peer.counts();
    }

    /** Ping the client by datagram when it is time. */
    void pingByDatagram() {
        DatagramPeer peer = datagrams;
        if (peer != null) {
            peer.ping();
        }
    }

    public double oldest() {
        return dispatcher.patience(this);
    }

    public void datagram(int type, long request, long sent, byte[] data, int offset, int length) {
        if (!isOpen()) {
            return;
        }
        if (!Messages.isRequest(type)) {
            dispatcher.handleDatagram(this, type, request, sent, data, offset, length);
            return;
        }
        synchronized (requests) {
            if ((int) (request - lastRequest) > 0 && (int) (request - anticipated) > 0) {
                anticipated = request;
                dispatcher.handleDatagram(this, type, request, sent, data, offset, length);
            }
        }
    }

    // ------------------------------------------------------------------------------------------- writing

    /** Send an answer at once in the reader's thread if the connection is free, otherwise through the outbox. */
    void answer(Message message, long request) {
        byte[] frame = frames.frame(message, request);
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
        writeFrame(frame, ours);
    }

    /** Open the session: the Welcome goes out first, and reflects all events before it; every later frame has a tag. */
    private void welcome() {
        synchronized (outbox) {
            if (ending || gone) {
                return;
            }
            writing = true;
        }
        theirs = handshake.clientTag(); // before the Welcome, after which the client sends tagged frames
        open = true; // events are queued from here on
        byte[] body = handshake.prove(identity.welcome(session).body());
        writeFrame(frames.frame(Welcome.TYPE, body), handshake.cabinetTag());
    }

    private void writeFrame(byte[] frame, FrameTag next) {
        try {
            write(frame);
            ours = next;
        } catch (IOException e) {
            leave("the connection broke (" + e.getMessage() + ")");
        } finally {
            synchronized (outbox) {
                writing = false;
                if (ending || !events.isEmpty() || !states.isEmpty() || missed > reported) {
                    outbox.notify(); // only then: waking the writer for nothing costs as much as the whole answer
                }
            }
        }
    }

    /** Queue an event. */
    void event(int type, byte[] body) {
        boolean full;
        synchronized (outbox) {
            full = events.size() >= MAX_EVENTS;
            if (!full && !ending) {
                events.add(frames.frame(type, body));
                outbox.notify();
            }
        }
        if (full) {
            leave("it does not read its events");
        }
    }

    /** Send a state by datagram, or queue it; drops the oldest when too many wait. */
    public void receive(State state) {
        if (!sendByDatagram(state)) {
            queue(frames.frame(state, 0));
        }
    }

    /**
     * Send a state at once in the sampler's thread if the connection is free; waking the writer costs as much as all the rest.
     * After a write that had to wait for the client, the writer has the next states.
     */
    public void receiveAlone(State state) {
        if (sendByDatagram(state)) {
            return;
        }
        byte[] frame = frames.frame(state, 0);
        long began = System.nanoTime();
        synchronized (outbox) {
            if (writing || ending || gone || began < unhurried || !events.isEmpty() || !states.isEmpty() || missed > reported) {
                queue(frame);
                return;
            }
            writing = true;
        }
        try {
            write(frame);
        } catch (IOException e) { // the reader reports it
        } finally {
            synchronized (outbox) {
                writing = false;
                if (ending || !events.isEmpty() || missed > reported) {
                    outbox.notify();
                }
            }
        }
        long end = System.nanoTime();
        if (end - began > SLOW_WRITE_NS) {
            unhurried = end + UNHURRIED_NS;
        }
    }

    private boolean sendByDatagram(State state) {
        DatagramPeer peer = datagrams;
        return peer != null && isOpen() && peer.offer(state);
    }

    private void queue(byte[] frame) {
        synchronized (outbox) {
            if (states.size() >= MAX_STATES) {
                states.poll();
                missed++;
            }
            states.add(frame);
            outbox.notify();
        }
    }

    /** States that were due were not sampled. */
    public void miss(long count) {
        synchronized (outbox) {
            missed += count;
            outbox.notify();
        }
    }

    /** Send a Goodbye with a reason, then end the connection. */
    void goodbye(int code, String text) {
        synchronized (outbox) {
            if (ending) {
                return;
            }
            events.add(frames.frame(new Goodbye(code, text), 0));
            ending = true;
            outbox.notify();
        }
        owner.ending(this, code, text);
    }

    private void writeAll() {
        try {
            while (!gone) {
                byte[] frame;
                synchronized (outbox) {
                    while (!gone && (writing || events.isEmpty() && states.isEmpty() && missed == reported && !ending)) {
                        outbox.wait();
                    }
                    frame = events.poll();
                    if (frame == null && ending) {
                        break;
                    }
                    if (frame == null && missed > reported) { // one report for all, however many the client has missed
                        frame = frames.frame(new StatesMissed(missed - reported), 0);
                        reported = missed;
                    } else if (frame == null) {
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
            leave("the cabinet application is closing");
        }
    }

    /** Close the sending side, and wait briefly for the client to close its side. */
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
        FrameEncoder.putInt(frame, FrameEncoder.SEQUENCE, seq++); // only the thread that holds `writing` gets here
        byte[] data = frame;
        int length = frame.length;
        if (ours != null) {
            data = withTag(frame);
            length += Protocol.TAG;
        }
        long now = clock.nanos();
        writeBegan = now;
        out.write(data, 0, length);
        lastSent = now;
        writeBegan = 0;
    }

    /** The frame with its tag, in a buffer that the next one overwrites. */
    private byte[] withTag(byte[] frame) {
        if (tagged.length < frame.length + Protocol.TAG) {
            tagged = new byte[2 * frame.length + Protocol.TAG];
        }
        System.arraycopy(frame, 0, tagged, 0, frame.length);
        tagged[FrameEncoder.FLAGS] = FrameEncoder.TAGGED;
        ours.write(tagged, 0, frame.length);
        if (seq == 0) {
            ours.beginRound();
        }
        return tagged;
    }

    // ------------------------------------------------------------------------------------------- the end

    /** End the connection at once. */
    void leave(String why) {
        synchronized (outbox) {
            if (gone) {
                return;
            }
            gone = true;
            port.remove(session);
            outbox.notifyAll();
        }
        try {
            socket.close();
        } catch (IOException e) {
            log.warn("closing " + address() + ": " + e);
        }
        owner.closed(this, why);
        if (missed > 0) {
            log.info(missed + " states were due for " + name() + " and were not sent: it reads too slowly, or they were sampled late");
        }
    }

    void join() {
        Threads.join(writer);
        leave("the cabinet application is closing");
        Threads.join(reader);
    }
}
