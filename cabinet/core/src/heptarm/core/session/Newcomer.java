package heptarm.core.session;

import java.io.IOException;
import java.io.InputStream;
import java.io.OutputStream;
import java.net.Socket;

import heptarm.core.CommandRejected;
import heptarm.wire.Code;
import heptarm.wire.Goodbye;
import heptarm.wire.Halt;
import heptarm.wire.Message;
import heptarm.wire.Protocol;
import heptarm.wire.Refusal;

/**
 * A connection that has no session yet. Nothing here waits: it reads what has arrived, and its few frames fit into any send
 * buffer. For one thread.
 */
final class Newcomer {
    /** Longest frame of a handshake [bytes]. */
    private static final int MAX_FRAME = 1024;

    final Socket socket;
    final String address;
    final Handshake handshake;
    private final InputStream in;
    private final OutputStream out;
    private final FrameEncoder frames;
    private final long since = System.nanoTime();
    private final byte[] data = new byte[MAX_FRAME];
    private int filled;
    private int received;
    private int sent;
    private volatile Halt halt;
    /** Why the stop failed; null: it did not. */
    volatile String failure;
    private boolean leaving;

    Newcomer(Socket socket, Handshake handshake, FrameEncoder frames) throws IOException {
        this.socket = socket;
        this.handshake = handshake;
        this.frames = frames;
        this.address = socket.getInetAddress().getHostAddress();
        this.in = socket.getInputStream();
        this.out = socket.getOutputStream();
    }

    /** Time since it connected [ns], of the machine: the network knows no simulated time. */
    long age() {
        return System.nanoTime() - since;
    }

    /** Whether everything is said; it is closed soon, but not before it could read why. */
    boolean isLeaving() {
        return leaving;
    }

    /** The stop that it requests; null: none. */
    Halt halt() {
        return halt;
    }

    /** Number of frames received. */
    int received() {
        return received;
    }

    /** Number of frames sent. */
    int sent() {
        return sent;
    }

    /** What it sent after its handshake. */
    byte[] unread() {
        byte[] rest = new byte[filled];
        System.arraycopy(data, 0, rest, 0, filled);
        return rest;
    }

    /** Handle what has arrived. */
    void serve() throws IOException {
        int count = Math.min(in.available(), data.length - filled);
        if (count <= 0 || halt != null && !leaving) {
            return;
        }
        filled += in.read(data, filled, count);
        if (leaving) {
            filled = 0; // unread bytes would discard our last frame when the socket is closed
        }
        while (filled >= Protocol.HEADER && !leaving && !handshake.isDone() && halt == null) {
            int length = FrameEncoder.getInt(data, FrameEncoder.LENGTH);
            if (((data[0] & 0xFF) << 8 | data[1] & 0xFF) != Protocol.MAGIC) {
                end(new Goodbye(Code.BAD_FRAME, "it sent bytes that are not a heptarm frame"));
                return;
            }
            if (length >= 0 && length <= MAX_FRAME - Protocol.HEADER && filled < Protocol.HEADER + length) {
                return;
            }
            handle(length);
        }
    }

    private void handle(int length) throws IOException {
        int version = data[2] & 0xFF;
        int type = (data[4] & 0xFF) << 8 | data[5] & 0xFF;
        boolean isShort = length >= 0 && length <= MAX_FRAME - Protocol.HEADER;
        try {
            if (version == Protocol.MAJOR && !isShort) {
                end(new Goodbye(Code.BAD_FRAME, "it sent bytes that are not a heptarm frame"));
                return;
            }
            if (version == Protocol.MAJOR && (data[FrameEncoder.FLAGS] != 0 || FrameEncoder.getInt(data, FrameEncoder.SEQUENCE) != received)) {
                end(new Goodbye(Code.FORGED_FRAME, "its frames are not counted from 0, or have flags before the session is open"));
                return;
            }
            Message answer = handshake.receive(version, type, data, Protocol.HEADER, isShort ? length : 0);
            received++;
            filled -= Protocol.HEADER + length;
            System.arraycopy(data, Protocol.HEADER + length, data, 0, filled);
            if (handshake.isClosed()) {
                leaving = true;
            } else if (answer instanceof Halt) {
                halt = (Halt) answer;
            } else if (answer != null) {
                send(answer);
            }
        } catch (CommandRejected e) {
            refuse(e.code, e.getMessage());
        }
    }

    /** Send one frame of the handshake. */
    private void send(Message message) throws IOException {
        byte[] frame = frames.frame(message, 0);
        FrameEncoder.putInt(frame, FrameEncoder.SEQUENCE, sent++);
        out.write(frame);
    }

    /** Send the last message. */
    void end(Message message) throws IOException {
        filled = 0;
        send(message);
        socket.shutdownOutput();
        leaving = true;
    }

    /** Refuse a session. */
    void refuse(int code, String text) throws IOException {
        end(new Refusal(code, text, Protocol.MAJOR, Protocol.MINOR));
    }

    void close() {
        try {
            socket.close();
        } catch (IOException e) { // it is gone either way
        }
    }
}
