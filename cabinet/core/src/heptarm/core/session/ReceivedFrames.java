package heptarm.core.session;

import java.io.IOException;
import java.io.InputStream;

import heptarm.core.key.FrameTag;
import heptarm.wire.Code;
import heptarm.wire.Protocol;

/**
 * Framing of what a client sends: bytes of a stream become frames, each of which is the next one of that client.
 *
 * <p>For one thread. The fields describe the current frame until the next call; its body is not copied.
 */
final class ReceivedFrames {
    private static final int CAPACITY = 16384;

    /** Message type, number of the request, and cabinet time at which the client sent it. */
    int type;
    long request;
    long stamp;
    /** The bytes in which the body is, where it begins, and its length. */
    byte[] data = new byte[CAPACITY];
    int body;
    int length;

    private int begin;
    private int filled;
    private int expected;
    private FrameTag tag;

    /** A frame that cannot be the next one of the client; the session ends with this code. */
    static final class Refused extends Exception {
        private static final long serialVersionUID = 1;

        final int code;

        Refused(int code, String text) {
            super(text);
            this.code = code;
        }
    }

    /**
     * @param unread bytes that the client has sent beside its Hello
     * @param expected sequence number of the next frame
     */
    ReceivedFrames(byte[] unread, int expected) {
        System.arraycopy(unread, 0, data, 0, unread.length);
        this.filled = unread.length;
        this.expected = expected;
    }

    /** Require this tag of each following frame; null: frames have none. */
    void require(FrameTag theirs) {
        tag = theirs;
    }

    /** Whether frames have tags, so that bytes alone prove nothing. */
    boolean isTagged() {
        return tag != null;
    }

    /** Wait for bytes; returns false at the end of the stream. */
    boolean read(InputStream in) throws IOException {
        if (begin > 0) {
            System.arraycopy(data, begin, data, 0, filled - begin);
            filled -= begin;
            begin = 0;
        }
        if (filled == data.length) {
            byte[] larger = new byte[Math.min(data.length * 4, Protocol.HEADER + Protocol.MAX_BODY + Protocol.TAG)];
            System.arraycopy(data, 0, larger, 0, filled);
            data = larger;
        }
        int count = in.read(data, filled, data.length - filled);
        filled += Math.max(count, 0);
        return count >= 0;
    }

    /** Discard the bytes that were read: a socket that is closed with unread bytes would discard the last frames to the client. */
    void discard() {
        begin = filled;
    }

    /** Go to the next frame; returns false if it is not complete. */
    boolean next() throws Refused {
        if (filled - begin < Protocol.HEADER) {
            return false;
        }
        length = FrameEncoder.getInt(data, begin + FrameEncoder.LENGTH);
        if (FrameEncoder.getU16(data, begin) != Protocol.MAGIC || length < 0 || length > Protocol.MAX_BODY) {
            throw new Refused(Code.BAD_FRAME, "it sent bytes that are not a heptarm frame");
        }
        if (data[begin + FrameEncoder.FLAGS] != (tag == null ? 0 : FrameEncoder.TAGGED)) {
            throw forged(tag == null ? "a frame has flags that this session does not have" : "a frame has no tag");
        }
        int rest = begin + Protocol.HEADER + length;
        int end = tag == null ? rest : rest + Protocol.TAG;
        if (filled < end) {
            return false;
        }
        if (tag != null && !tag.fits(data, begin, rest)) {
            throw forged("a frame has a wrong tag");
        }
        int number = FrameEncoder.getInt(data, begin + FrameEncoder.SEQUENCE);
        if (number != expected) {
            throw forged("frame " + (expected & 0xFFFFFFFFL) + " was expected, frame " + (number & 0xFFFFFFFFL) + " came");
        }
        expected++;
        if (expected == 0 && tag != null) {
            tag.beginRound();
        }
        int major = data[begin + FrameEncoder.VERSION] & 0xFF;
        if (major != Protocol.MAJOR) {
            throw new Refused(Code.WRONG_VERSION, "a frame has protocol version " + major + ", this cabinet has " + Protocol.MAJOR);
        }
        type = FrameEncoder.getU16(data, begin + FrameEncoder.TYPE);
        request = FrameEncoder.getU32(data, begin + FrameEncoder.REQUEST);
        stamp = FrameEncoder.getLong(data, begin + FrameEncoder.STAMP);
        body = begin + Protocol.HEADER;
        begin = end;
        return true;
    }

    private static Refused forged(String what) {
        return new Refused(Code.FORGED_FRAME, what + ": it was forged, changed, repeated, reordered or lost in transit");
    }
}
