package heptarm.core.session;

import java.net.InetAddress;

import heptarm.core.Clock;
import heptarm.core.CommandRejected;
import heptarm.core.key.KeyExchange;
import heptarm.wire.Code;
import heptarm.wire.DatagramStatistics;
import heptarm.wire.DatagramToken;
import heptarm.wire.Messages;
import heptarm.wire.State;

/**
 * The datagrams of a session beside its TCP connection: opened on request, with another token each time.
 *
 * <p>A request may come twice, by datagram and over TCP. The datagram is handled only if it is newer than every request over
 * TCP and every one that a datagram has anticipated. So it is handled before its twin over TCP or never, and a late Stop
 * cannot end a motion that was begun after it. {@link #requested} must therefore come before the request is handled.
 */
final class SessionDatagrams implements DatagramPeer.Receiver {
    private final ClientConnection client;
    private final InetAddress address;
    private final Handshake handshake;
    private final DatagramPort port;
    private final RequestDispatcher dispatcher;
    private final FrameEncoder frames;
    private final Clock clock;
    private volatile DatagramPeer peer;
    private boolean closed;
    private final Object requests = new Object();
    /** Newest request over TCP, and newest one that a datagram anticipated. */
    private long lastRequest;
    private long anticipated;

    SessionDatagrams(ClientConnection client, InetAddress address, Handshake handshake, DatagramPort port, RequestDispatcher dispatcher,
            FrameEncoder frames, Clock clock) {
        this.client = client;
        this.address = address;
        this.handshake = handshake;
        this.port = port;
        this.dispatcher = dispatcher;
        this.frames = frames;
        this.clock = clock;
    }

    /** Open datagrams, or open them again with another token. */
    DatagramToken open() throws CommandRejected {
        if (!port.isOpen()) {
            throw new CommandRejected(Code.UNSUPPORTED, "this cabinet has no UDP port: the process data heptarm.datagrams is 0, or another"
                    + " program has taken the port; the smartPAD shows which");
        }
        byte[] token = Handshake.token();
        byte[] secret = handshake.datagramSecret(token);
        DatagramPeer opened = new DatagramPeer(client.session(), address, port, KeyExchange.clientDatagramTag(secret, token),
                KeyExchange.cabinetDatagramTag(secret, token), frames, clock, this);
        synchronized (this) {
            if (closed) { // nobody would remove it from the port
                throw new CommandRejected(Code.UNSUPPORTED, "the connection has ended; connect again");
            }
            peer = opened;
            port.add(opened);
        }
        return new DatagramToken(token);
    }

    synchronized void close() {
        closed = true;
        port.remove(client.session());
    }

    /** What was counted; all 0 if they are not open. */
    DatagramStatistics counts() {
        DatagramPeer now = peer;
        return now == null ? new DatagramStatistics(0, 0, 0, 0, 0, port.strange(), 0) : now.counts();
    }

    /** Ping the client when it is time. */
    void ping() {
        DatagramPeer now = peer;
        if (now != null) {
            now.ping();
        }
    }

    /** Cabinet time at which the client sent the newest datagram; the least long: none has come. */
    long heard() {
        DatagramPeer now = peer;
        return now == null ? Long.MIN_VALUE : now.heard();
    }

    /** Send a state; returns false if datagrams do not reach the client. */
    boolean offer(State state) {
        DatagramPeer now = peer;
        return now != null && client.isOpen() && now.offer(state);
    }

    /** A message has come over TCP: no datagram anticipates it any more. */
    void requested(int type, long request) {
        synchronized (requests) {
            lastRequest = Messages.isRequest(type) ? request : lastRequest;
        }
    }

    public double oldest() {
        return dispatcher.patience(client);
    }

    public void datagram(int type, long request, long sent, byte[] data, int offset, int length) {
        if (!client.isOpen()) {
            return;
        }
        if (!Messages.isRequest(type)) {
            dispatcher.handleDatagram(client, type, request, sent, data, offset, length);
            return;
        }
        synchronized (requests) { // until it is handled: its twin over TCP waits
            if ((int) (request - lastRequest) > 0 && (int) (request - anticipated) > 0) {
                anticipated = request;
                dispatcher.handleDatagram(client, type, request, sent, data, offset, length);
            }
        }
    }
}
