package heptarm.core.session;

import java.io.IOException;
import java.io.OutputStream;

import heptarm.core.Clock;
import heptarm.core.key.FrameTag;
import heptarm.wire.Protocol;

/**
 * Framing of what a client receives: each frame gets its sequence number and, with a key, its tag, and is written at once.
 *
 * <p>For one thread at a time: the one that has the {@link Outbox}. Any thread may read the times.
 */
final class SentFrames {
    private final OutputStream out;
    private final Clock clock;
    private int seq;
    private FrameTag tag;
    private byte[] tagged = new byte[0];
    private volatile long lastSent;
    private volatile long began;

    /** @param seq number of the next frame */
    SentFrames(OutputStream out, int seq, Clock clock) {
        this.out = out;
        this.seq = seq;
        this.clock = clock;
        this.lastSent = clock.nanos();
    }

    /** Tag each following frame; null: frames have no tags. */
    void tagWith(FrameTag ours) {
        tag = ours;
    }

    void write(byte[] frame) throws IOException {
        FrameEncoder.putInt(frame, FrameEncoder.SEQUENCE, seq++);
        byte[] data = frame;
        int length = frame.length;
        if (tag != null) {
            data = withTag(frame);
            length += Protocol.TAG;
        }
        long now = clock.nanos();
        began = now;
        out.write(data, 0, length);
        lastSent = now;
        began = 0;
    }

    /** The frame with its tag, in a buffer that the next one overwrites. */
    private byte[] withTag(byte[] frame) {
        if (tagged.length < frame.length + Protocol.TAG) {
            tagged = new byte[2 * frame.length + Protocol.TAG];
        }
        System.arraycopy(frame, 0, tagged, 0, frame.length);
        tagged[FrameEncoder.FLAGS] = FrameEncoder.TAGGED;
        tag.write(tagged, 0, frame.length);
        if (seq == 0) {
            tag.beginRound();
        }
        return tagged;
    }

    /** Cabinet time of the last frame. */
    long lastSent() {
        return lastSent;
    }

    /** Cabinet time at which the current write began; 0: none. */
    long began() {
        return began;
    }
}
