package heptarm.core.key;

import java.security.GeneralSecurityException;

import javax.crypto.Mac;
import javax.crypto.spec.SecretKeySpec;

import heptarm.wire.Encoder;

/**
 * What the pre-shared key proves in one handshake, and the keys of the session that follows. The formulas are on the page about
 * the protocol; Python has the same in heptarm/wire/key.py.
 */
public final class KeyExchange {
    static final String HMAC = "HmacSHA256";

    private final byte[] key;
    private byte[] parts = new byte[0];

    public KeyExchange(String key) {
        this.key = Encoder.utf8(key);
    }

    /** Adds the next message of the handshake: its id and its body. */
    public void add(int type, byte[] data, int offset, int length) {
        parts = join(parts, part(type, length), data, offset, length);
    }

    /** The client's proof, after Hello and Challenge. */
    public byte[] clientMac() {
        return hmac(key, join(label("heptarm client", 0), parts, parts, 0, 0));
    }

    /**
     * The cabinet's proof, after Hello, Challenge and Proof.
     *
     * @param welcome body of the Welcome with an empty mac
     */
    public byte[] cabinetMac(int type, byte[] welcome) {
        byte[] earlier = join(label("heptarm cabinet", 0), parts, parts, 0, 0);
        return hmac(key, join(earlier, part(type, welcome.length), welcome, 0, welcome.length));
    }

    /** Tags of the client's frames. */
    public FrameTag clientTag(byte[] clientNonce, byte[] cabinetNonce) {
        return new FrameTag(hmac(secret(clientNonce, cabinetNonce), label("heptarm client to cabinet", 1)));
    }

    /** Tags of the cabinet's frames. */
    public FrameTag cabinetTag(byte[] clientNonce, byte[] cabinetNonce) {
        return new FrameTag(hmac(secret(clientNonce, cabinetNonce), label("heptarm cabinet to client", 1)));
    }

    /** The secret of which the keys of the session follow. */
    public byte[] secret(byte[] clientNonce, byte[] cabinetNonce) {
        return hmac(join(clientNonce, cabinetNonce, cabinetNonce, 0, 0), key);
    }

    /** Tags of the client's datagrams; secret: of the session, or the token if there is no key. */
    public static FrameTag clientDatagramTag(byte[] secret, byte[] token) {
        return datagramTag(secret, "heptarm client to cabinet datagrams", token);
    }

    /** Tags of the cabinet's datagrams; secret: of the session, or the token if there is no key. */
    public static FrameTag cabinetDatagramTag(byte[] secret, byte[] token) {
        return datagramTag(secret, "heptarm cabinet to client datagrams", token);
    }

    private static FrameTag datagramTag(byte[] secret, String label, byte[] token) {
        return new FrameTag(hmac(secret, join(Encoder.utf8(label), token, new byte[] {1}, 0, 1)));
    }

    private static byte[] part(int type, int length) {
        return new byte[] {(byte) (type >>> 8), (byte) type, (byte) (length >>> 24), (byte) (length >>> 16), (byte) (length >>> 8),
            (byte) length};
    }

    private static byte[] label(String text, int end) {
        byte[] bytes = Encoder.utf8(text);
        return join(bytes, new byte[] {(byte) end}, bytes, 0, 0);
    }

    private static byte[] join(byte[] first, byte[] second, byte[] third, int offset, int length) {
        byte[] all = new byte[first.length + second.length + length];
        System.arraycopy(first, 0, all, 0, first.length);
        System.arraycopy(second, 0, all, first.length, second.length);
        System.arraycopy(third, offset, all, first.length + second.length, length);
        return all;
    }

    static Mac mac(byte[] key) {
        try {
            Mac mac = Mac.getInstance(HMAC);
            mac.init(new SecretKeySpec(key, HMAC));
            return mac;
        } catch (GeneralSecurityException e) {
            throw new IllegalStateException("no HMAC-SHA-256", e);
        }
    }

    private static byte[] hmac(byte[] key, byte[] data) {
        return mac(key).doFinal(data);
    }
}
