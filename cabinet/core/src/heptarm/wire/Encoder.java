package heptarm.wire;

import java.io.UnsupportedEncodingException;

/** Big-endian bytes into a growing buffer. NaN is written in its canonical form. */
public final class Encoder {
    private byte[] data;
    private int size;

    public Encoder() {
        this(256);
    }

    public Encoder(int capacity) {
        data = new byte[capacity];
    }

    public static byte[] utf8(String value) {
        try {
            return value.getBytes("UTF-8");
        } catch (UnsupportedEncodingException impossible) {
            throw new IllegalStateException("no UTF-8", impossible);
        }
    }

    public byte[] data() {
        return data;
    }

    public int size() {
        return size;
    }

    public void clear() {
        size = 0;
    }

    public byte[] toBytes() {
        byte[] result = new byte[size];
        System.arraycopy(data, 0, result, 0, size);
        return result;
    }

    private int grow(int bytes) {
        if (size + bytes > data.length) {
            byte[] larger = new byte[Math.max(data.length * 2, size + bytes)];
            System.arraycopy(data, 0, larger, 0, size);
            data = larger;
        }
        int at = size;
        size += bytes;
        return at;
    }

    public void putBool(boolean value) {
        putU8(value ? 1 : 0);
    }

    public void putU8(int value) {
        int at = grow(1);
        data[at] = (byte) value;
    }

    public void putU16(int value) {
        int at = grow(2);
        data[at] = (byte) (value >>> 8);
        data[at + 1] = (byte) value;
    }

    public void putU32(long value) {
        putI32((int) value);
    }

    public void putI32(int value) {
        int at = grow(4);
        data[at] = (byte) (value >>> 24);
        data[at + 1] = (byte) (value >>> 16);
        data[at + 2] = (byte) (value >>> 8);
        data[at + 3] = (byte) value;
    }

    public void putI64(long value) {
        int at = grow(8);
        for (int i = 7; i >= 0; i--) {
            data[at + i] = (byte) value;
            value >>>= 8;
        }
    }

    public void putF64(double value) {
        putI64(Double.doubleToLongBits(value));
    }

    public void putF64s(double[] values, int count) {
        if (values.length != count) {
            throw new IllegalArgumentException(values.length + " numbers where " + count + " belong");
        }
        for (int i = 0; i < count; i++) {
            putF64(values[i]);
        }
    }

    public void putCount(int count) {
        if (count > 65535) {
            throw new IllegalArgumentException("a list of " + count + " entries; the protocol carries 65535");
        }
        putU16(count);
    }

    public void putStr(String value) {
        byte[] bytes = utf8(value);
        int length = bytes.length;
        if (length > 65535) {
            length = 65535;
            while (length > 0 && (bytes[length] & 0xC0) == 0x80) {
                length--; // never cut inside a character
            }
        }
        putU16(length);
        put(bytes, length);
    }

    public void putBytes(byte[] value) {
        putU32(value.length);
        put(value, value.length);
    }

    private void put(byte[] bytes, int length) {
        int at = grow(length);
        System.arraycopy(bytes, 0, data, at, length);
    }
}
