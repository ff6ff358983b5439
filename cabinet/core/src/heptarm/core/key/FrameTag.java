package heptarm.core.key;

import javax.crypto.Mac;
import javax.crypto.ShortBufferException;

import heptarm.wire.Protocol;

/** Tags of the frames of one direction: truncated HMAC-SHA-256. For one thread at a time; allocates nothing for a frame. */
public final class FrameTag {
    private static final int MAC = 32;

    private final Mac mac;
    private final byte[] result = new byte[MAC];
    private final byte[] round = new byte[4];

    FrameTag(byte[] key) {
        mac = KeyExchange.mac(key);
    }

    /** The sequence number of this direction has wrapped. */
    public void beginRound() {
        int at = round.length - 1;
        while (at >= 0 && ++round[at] == 0) {
            at--;
        }
    }

    /** Write the tag of the frame that ends at `end`, header and body, behind it. */
    public void write(byte[] data, int start, int end) {
        compute(data, start, end);
        System.arraycopy(result, 0, data, end, Protocol.TAG);
    }

    /** Whether the bytes behind a frame are its tag. */
    public boolean fits(byte[] data, int start, int end) {
        compute(data, start, end);
        int difference = 0;
        for (int i = 0; i < Protocol.TAG; i++) { // all of them: the time must not tell where the first difference is
            difference |= result[i] ^ data[end + i];
        }
        return difference == 0;
    }

    private void compute(byte[] data, int start, int end) {
        mac.update(round);
        mac.update(data, start, end - start);
        try {
            mac.doFinal(result, 0);
        } catch (ShortBufferException e) {
            throw new IllegalStateException("an HMAC-SHA-256 has " + MAC + " bytes", e);
        }
    }
}
