package heptarm.wire;

import java.nio.ByteBuffer;
import java.nio.CharBuffer;
import java.nio.charset.CharacterCodingException;
import java.nio.charset.Charset;

/** Reads one body; anything that does not fit is a WireException, never another one. */
public final class Decoder {
    private static final Charset UTF8 = Charset.forName("UTF-8");

    private final byte[] data;
    private final int end;
    private int pos;

    public Decoder(byte[] data, int offset, int length) {
        this.data = data;
        this.pos = offset;
        this.end = offset + length;
    }

    private int take(int bytes) throws WireException {
        if (bytes < 0 || bytes > end - pos) {
            throw new WireException("body is cut: " + bytes + " bytes wanted, " + (end - pos) + " left");
        }
        int at = pos;
        pos += bytes;
        return at;
    }

    /** The body must end here. */
    public void end() throws WireException {
        if (pos != end) {
            throw new WireException((end - pos) + " bytes behind the end");
        }
    }

    public boolean getBool() throws WireException {
        int value = getU8();
        if (value > 1) {
            throw new WireException("a boolean is " + value);
        }
        return value == 1;
    }

    public int getU8() throws WireException {
        return data[take(1)] & 0xFF;
    }

    public int getU16() throws WireException {
        int at = take(2);
        return (data[at] & 0xFF) << 8 | data[at + 1] & 0xFF;
    }

    public int getCount() throws WireException {
        int count = getU16();
        if (count > end - pos) {
            throw new WireException("a list of " + count + " entries in " + (end - pos) + " bytes");
        }
        return count;
    }

    public long getU32() throws WireException {
        return getI32() & 0xFFFFFFFFL;
    }

    public int getI32() throws WireException {
        int at = take(4);
        return (data[at] & 0xFF) << 24 | (data[at + 1] & 0xFF) << 16 | (data[at + 2] & 0xFF) << 8 | data[at + 3] & 0xFF;
    }

    public long getI64() throws WireException {
        long high = getI32();
        return high << 32 | getI32() & 0xFFFFFFFFL;
    }

    public double getF64() throws WireException {
        return Double.longBitsToDouble(getI64());
    }

    public double[] getF64s(int count) throws WireException {
        double[] values = new double[count];
        for (int i = 0; i < count; i++) {
            values[i] = getF64();
        }
        return values;
    }

    public String getStr() throws WireException {
        int length = getU16();
        int at = take(length);
        try {
            CharBuffer text = UTF8.newDecoder().decode(ByteBuffer.wrap(data, at, length));
            return text.toString();
        } catch (CharacterCodingException e) {
            throw new WireException("a text is not UTF-8");
        }
    }

    public byte[] getBytes() throws WireException {
        long length = getU32();
        if (length > end - pos) {
            throw new WireException("body is cut: " + length + " bytes wanted, " + (end - pos) + " left");
        }
        int at = take((int) length);
        byte[] value = new byte[(int) length];
        System.arraycopy(data, at, value, 0, value.length);
        return value;
    }
}
