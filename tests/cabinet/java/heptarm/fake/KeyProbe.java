package heptarm.fake;

import java.util.Arrays;

import heptarm.core.key.FrameTag;
import heptarm.core.key.KeyExchange;
import heptarm.wire.Challenge;
import heptarm.wire.Hello;
import heptarm.wire.Proof;
import heptarm.wire.Protocol;
import heptarm.wire.Welcome;

/**
 * What the cabinet computes with a key, from: key, bodies of Hello, Challenge, Proof and of a Welcome without mac, both nonces, a
 * client's frame and a cabinet's frame without tags; then the token, and a client's and a cabinet's datagram with their tags, first
 * those with the key, then those without. The client's frame has two tags: before its sequence number wraps, and after.
 */
public final class KeyProbe {
    private KeyProbe() {
    }

    public static void main(String[] args) {
        KeyExchange exchange = new KeyExchange(args[0]);
        byte[] hello = bytes(args[1]);
        byte[] challenge = bytes(args[2]);
        byte[] proof = bytes(args[3]);
        byte[] clientNonce = bytes(args[5]);
        byte[] cabinetNonce = bytes(args[6]);
        exchange.add(Hello.TYPE, hello, 0, hello.length);
        exchange.add(Challenge.TYPE, challenge, 0, challenge.length);
        print(exchange.clientMac());
        exchange.add(Proof.TYPE, proof, 0, proof.length);
        print(exchange.cabinetMac(Welcome.TYPE, bytes(args[4])));
        FrameTag client = exchange.clientTag(clientNonce, cabinetNonce);
        tag(client, bytes(args[7]));
        client.beginRound();
        tag(client, bytes(args[7]));
        tag(exchange.cabinetTag(clientNonce, cabinetNonce), bytes(args[8]));
        byte[] token = bytes(args[9]);
        byte[] secret = exchange.secret(clientNonce, cabinetNonce);
        for (int i = 10; i < args.length; i += 2) {
            byte[] base = i == 10 ? secret : token;
            fits(KeyExchange.clientDatagramTag(base, token), bytes(args[i]));
            fits(KeyExchange.cabinetDatagramTag(base, token), bytes(args[i + 1]));
        }
    }

    private static void tag(FrameTag tag, byte[] frame) {
        byte[] data = Arrays.copyOf(frame, frame.length + Protocol.TAG);
        tag.write(data, 0, frame.length);
        if (!tag.fits(data, 0, frame.length)) {
            throw new IllegalStateException("a tag does not fit its own frame");
        }
        print(Arrays.copyOfRange(data, frame.length, data.length));
    }

    /** Prints the number of the session if the tag of a datagram is right. */
    private static void fits(FrameTag tag, byte[] datagram) {
        if (!tag.fits(datagram, 4, datagram.length - Protocol.TAG)) {
            throw new IllegalStateException("a datagram has a wrong tag");
        }
        print(Arrays.copyOf(datagram, 4));
    }

    private static byte[] bytes(String hex) {
        byte[] data = new byte[hex.length() / 2];
        for (int i = 0; i < data.length; i++) {
            data[i] = (byte) Integer.parseInt(hex.substring(2 * i, 2 * i + 2), 16);
        }
        return data;
    }

    private static void print(byte[] data) {
        StringBuilder text = new StringBuilder();
        for (byte one : data) {
            text.append(String.format("%02x", one));
        }
        System.out.println(text);
    }
}
