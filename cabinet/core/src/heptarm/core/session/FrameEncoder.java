package heptarm.core.session;

import heptarm.core.Clock;
import heptarm.wire.Encoder;
import heptarm.wire.Message;
import heptarm.wire.Protocol;

/** Encodes frames; the connection that sends one fills in its sequence number. */
final class FrameEncoder {
    /** Offsets of the fields of a header; before them is the magic number. */
    static final int VERSION = 2;
    static final int FLAGS = 3;
    static final int TYPE = 4;
    static final int LENGTH = 6;
    static final int SEQUENCE = 10;
    static final int REQUEST = 14;
    static final int STAMP = 18;
    /** Flag of a frame that ends with a tag. */
    static final int TAGGED = 1;
    /** Initial buffer size [bytes]; most frames fit into it. */
    private static final int CAPACITY = 1024;

    private final Clock clock;

    FrameEncoder(Clock clock) {
        this.clock = clock;
    }

    byte[] frame(Message message, long request) {
        Encoder out = header(message.type(), request, CAPACITY);
        message.write(out);
        return withLength(out.toBytes());
    }

    /** A frame with a body that was encoded once for many clients. */
    byte[] frame(int type, byte[] body) {
        byte[] whole = new byte[Protocol.HEADER + body.length];
        System.arraycopy(header(type, 0, Protocol.HEADER).data(), 0, whole, 0, Protocol.HEADER);
        System.arraycopy(body, 0, whole, Protocol.HEADER, body.length);
        return withLength(whole);
    }

    private Encoder header(int type, long request, int capacity) {
        Encoder out = new Encoder(capacity);
        out.putU16(Protocol.MAGIC);
        out.putU8(Protocol.MAJOR);
        out.putU8(0);
        out.putU16(type);
        out.putU32(0);
        out.putU32(0);
        out.putU32(request);
        out.putI64(clock.nanos());
        return out;
    }

    private static byte[] withLength(byte[] frame) {
        putInt(frame, LENGTH, frame.length - Protocol.HEADER);
        return frame;
    }

    static int getU16(byte[] data, int at) {
        return (data[at] & 0xFF) << 8 | data[at + 1] & 0xFF;
    }

    static long getU32(byte[] data, int at) {
        return getInt(data, at) & 0xFFFFFFFFL;
    }

    static long getLong(byte[] data, int at) {
        return (long) getInt(data, at) << 32 | getU32(data, at + 4);
    }

    static int getInt(byte[] data, int at) {
        return (data[at] & 0xFF) << 24 | (data[at + 1] & 0xFF) << 16 | (data[at + 2] & 0xFF) << 8 | data[at + 3] & 0xFF;
    }

    static void putInt(byte[] data, int at, int value) {
        for (int i = 0; i < 4; i++) {
            data[at + i] = (byte) (value >>> 24 - 8 * i);
        }
    }
}
