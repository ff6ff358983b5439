package heptarm.core.session;

import java.io.IOException;
import java.net.DatagramPacket;
import java.net.DatagramSocket;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;

import heptarm.core.FailureLog;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.wire.Protocol;

/**
 * The UDP port beside the TCP port: finds the session of each datagram; what belongs to none is counted and forgotten.
 *
 * <p>One thread receives for all sessions. Nobody gets an answer who has not proved that he is in a session.
 */
final class DatagramPort {
    /** Longer than any datagram, so that one that is too long is noticed. */
    private static final int BUFFER = 2048;

    private final Log log;
    private final Map<Integer, DatagramPeer> peers = new ConcurrentHashMap<Integer, DatagramPeer>();
    private DatagramSocket socket;
    private Thread receiver;
    private volatile boolean closed;
    private volatile long strange;

    DatagramPort(Log log) {
        this.log = log;
    }

    /** Open the port and start the thread. */
    void open(String bind, int port) throws IOException {
        DatagramSocket opened = new DatagramSocket(new InetSocketAddress(InetAddress.getByName(bind), port));
        synchronized (this) {
            socket = opened;
        }
        receiver = Threads.start("ha-datagrams", new Runnable() {
            public void run() {
                receive();
            }
        });
    }

    /** Whether datagrams can be received. */
    synchronized boolean isOpen() {
        return socket != null && !closed;
    }

    void close() {
        closed = true;
        synchronized (this) {
            if (socket != null) {
                socket.close();
            }
        }
        Threads.join(receiver);
    }

    /** Receive the datagrams of a session, instead of those with an earlier token. */
    void add(DatagramPeer peer) {
        peers.put(peer.session, peer);
    }

    void remove(int session) {
        peers.remove(session);
    }

    /** Datagrams of no session, or from another address than its session. */
    long strange() {
        return strange;
    }

    /** Send a datagram; false if the system refuses it. */
    boolean send(byte[] data, int length, InetAddress address, int port) {
        try {
            socket.send(new DatagramPacket(data, length, address, port));
            return true;
        } catch (IOException e) { // like a lost datagram
            return false;
        }
    }

    private void receive() {
        byte[] data = new byte[BUFFER];
        DatagramPacket packet = new DatagramPacket(data, data.length);
        FailureLog failures = new FailureLog(log);
        boolean failing = false;
        while (!closed) {
            try {
                packet.setLength(data.length);
                socket.receive(packet);
                pass(data, packet.getLength(), packet.getAddress(), packet.getPort());
                failing = false;
                failures.succeeded();
            } catch (IOException e) {
                if (!closed) {
                    if (!failing) {
                        log.warn("receiving a datagram: " + e);
                    }
                    failing = true;
                    Threads.pause();
                }
            } catch (Throwable e) {
                failures.failed("handling a datagram", e);
            }
        }
    }

    private void pass(byte[] data, int length, InetAddress address, int port) {
        DatagramPeer peer = length < Protocol.HEADER ? null : peers.get(FrameEncoder.getInt(data, 0));
        if (peer == null || !peer.address.equals(address)) {
            strange++; // only this thread counts
            return;
        }
        peer.receive(data, length, port);
    }
}
