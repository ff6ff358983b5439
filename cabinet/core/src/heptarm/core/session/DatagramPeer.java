package heptarm.core.session;

import java.net.InetAddress;

import heptarm.core.Clock;
import heptarm.core.key.FrameTag;
import heptarm.wire.Cancel;
import heptarm.wire.DatagramStatistics;
import heptarm.wire.Decoder;
import heptarm.wire.Message;
import heptarm.wire.Messages;
import heptarm.wire.Ping;
import heptarm.wire.Pong;
import heptarm.wire.Protocol;
import heptarm.wire.State;
import heptarm.wire.Stop;
import heptarm.wire.WireException;

/**
 * The datagrams of one session: which of the client's count, and whether the cabinet's reach the client.
 *
 * <p>The thread of the port receives; several threads send.
 */
final class DatagramPeer {
    private static final int PREFIX = 4;
    /** The cabinet's pings: their period, and how long an answer counts [client's s]. */
    private static final double PING = 0.1;
    private static final double ANSWER = 0.5;
    /** Streams of the client; within one, only newer datagrams count. */
    private static final int TARGETS = 0;
    private static final int REQUESTS = 1;
    private static final int PINGS = 2;
    private static final int PONGS = 3;

    final int session;
    final InetAddress address;
    private final DatagramPort port;
    private final FrameTag theirs;
    private final FrameTag ours;
    private final FrameEncoder frames;
    private final Clock clock;
    private final Receiver receiver;
    private final long[] newest = {-1, -1, -1, -1};
    private long seq;
    private byte[] packed = new byte[Protocol.MAX_DATAGRAM];
    /** From where the client sends; 0: nothing came yet. */
    private volatile int from;
    private volatile long heard = Long.MIN_VALUE;
    private volatile long answered = Long.MIN_VALUE;
    private volatile long pinged = Long.MIN_VALUE;
    private volatile long accepted;
    private volatile long old;
    private volatile long late;
    private volatile long forged;
    private volatile long damaged;

    /** Receives what counts; the thread of the port calls it. */
    interface Receiver {
        /** Longest age of a datagram [client's s]. */
        double oldest();

        /** Handle a servo target, a Stop or a Cancel. */
        void datagram(int type, long request, long sent, byte[] data, int offset, int length);
    }

    DatagramPeer(int session, InetAddress address, DatagramPort port, FrameTag theirs, FrameTag ours, FrameEncoder frames, Clock clock,
            Receiver receiver) {
        this.session = session;
        this.address = address;
        this.port = port;
        this.theirs = theirs;
        this.ours = ours;
        this.frames = frames;
        this.clock = clock;
        this.receiver = receiver;
    }

    // ------------------------------------------------------------------------------------------- receiving

    /** Handle a datagram from the session's address; bytes 0 to 3 are its number. */
    void receive(byte[] data, int length, int fromPort) {
        int end = length - Protocol.TAG;
        if (!isFrame(data, length, end)) {
            damaged++;
            return;
        }
        if (!theirs.fits(data, PREFIX, end)) {
            forged++;
            return;
        }
        int type = FrameEncoder.getU16(data, PREFIX + FrameEncoder.TYPE);
        if (!Messages.byDatagram(type) || !Messages.fromClient(type)) {
            damaged++;
            return;
        }
        int stream = stream(type);
        long number = FrameEncoder.getU32(data, PREFIX + FrameEncoder.SEQUENCE);
        if (number <= newest[stream]) {
            old++;
            return;
        }
        long now = clock.nanos();
        long sent = FrameEncoder.getLong(data, PREFIX + FrameEncoder.STAMP);
        if (sent < now - (long) (receiver.oldest() * clock.rate() * 1e9)) {
            late++;
            return;
        }
        newest[stream] = number;
        accepted++;
        from = fromPort;
        heard = Math.max(heard, Math.min(sent, now));
        handle(type, FrameEncoder.getU32(data, PREFIX + FrameEncoder.REQUEST), sent, data, PREFIX + Protocol.HEADER,
                end - PREFIX - Protocol.HEADER, now);
    }

    private static boolean isFrame(byte[] data, int length, int end) {
        return length <= Protocol.MAX_DATAGRAM && end >= PREFIX + Protocol.HEADER
                && FrameEncoder.getU16(data, PREFIX) == Protocol.MAGIC
                && (data[PREFIX + FrameEncoder.VERSION] & 0xFF) == Protocol.MAJOR && data[PREFIX + FrameEncoder.FLAGS] == FrameEncoder.TAGGED
                && FrameEncoder.getInt(data, PREFIX + FrameEncoder.LENGTH) == end - PREFIX - Protocol.HEADER;
    }

    private static int stream(int type) {
        switch (type) {
            case Ping.TYPE:
                return PINGS;
            case Pong.TYPE:
                return PONGS;
            case Stop.TYPE:
            case Cancel.TYPE:
                return REQUESTS;
            default:
                return TARGETS;
        }
    }

    private void handle(int type, long request, long sent, byte[] data, int offset, int length, long now) {
        if (type != Ping.TYPE && type != Pong.TYPE) {
            receiver.datagram(type, request, sent, data, offset, length);
            return;
        }
        Decoder in = new Decoder(data, offset, length);
        try {
            if (type == Ping.TYPE) {
                Ping ping = Ping.read(in);
                in.end();
                send(new Pong(ping.sent, now));
            } else {
                Pong pong = Pong.read(in);
                in.end();
                answered = Math.max(answered, Math.min(pong.sent, now)); // our own clock, in our own ping
            }
        } catch (WireException e) {
            damaged++;
        }
    }

    /** Cabinet time at which the client sent the newest datagram; the least long: none has come. */
    long heard() {
        return heard;
    }

    // ------------------------------------------------------------------------------------------- sending

    /** Ping the client when it is time. */
    void ping() {
        long now = clock.nanos();
        if (from != 0 && (pinged == Long.MIN_VALUE || now - pinged >= PING * clock.rate() * 1e9)) {
            pinged = now;
            send(new Ping(now));
        }
    }

    /** Send a state, if datagrams reach the client and it fits into one; returns whether it was sent. */
    boolean offer(State state) {
        if (answered == Long.MIN_VALUE || clock.nanos() - answered > ANSWER * clock.rate() * 1e9) {
            return false;
        }
        return send(state);
    }

    private boolean send(Message message) {
        return send(frames.frame(message, 0));
    }

    private synchronized boolean send(byte[] frame) {
        int end = PREFIX + frame.length;
        if (end + Protocol.TAG > packed.length || seq > 0xFFFFFFFFL) {
            return false;
        }
        FrameEncoder.putInt(packed, 0, session);
        System.arraycopy(frame, 0, packed, PREFIX, frame.length);
        FrameEncoder.putInt(packed, PREFIX + FrameEncoder.SEQUENCE, (int) seq++);
        packed[PREFIX + FrameEncoder.FLAGS] = FrameEncoder.TAGGED;
        ours.write(packed, PREFIX, end);
        return port.send(packed, end + Protocol.TAG, address, from);
    }

    synchronized DatagramStatistics counts() {
        return new DatagramStatistics(accepted, old, late, forged, damaged, port.strange(), seq);
    }
}
