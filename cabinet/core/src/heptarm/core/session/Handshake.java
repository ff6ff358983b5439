package heptarm.core.session;

import java.security.MessageDigest;
import java.security.SecureRandom;

import heptarm.core.CommandRejected;
import heptarm.core.PrintableText;
import heptarm.core.key.FrameTag;
import heptarm.core.key.KeyExchange;
import heptarm.wire.Challenge;
import heptarm.wire.Code;
import heptarm.wire.Halt;
import heptarm.wire.Hello;
import heptarm.wire.Message;
import heptarm.wire.Messages;
import heptarm.wire.Proof;
import heptarm.wire.Protocol;
import heptarm.wire.SessionState;
import heptarm.wire.SessionTransitions;
import heptarm.wire.Violation;
import heptarm.wire.Welcome;
import heptarm.wire.WireException;

/**
 * The first messages of a connection: versions and the key, or a Halt. The schema's table lists which message is legal when. It
 * sends nothing itself.
 */
final class Handshake {
    private static final SecureRandom RANDOM = new SecureRandom();

    private final KeyExchange exchange;
    private SessionState state = SessionState.START;
    private String name = "a client";
    private Hello hello;
    private byte[] nonce;

    /** Without a key for an empty one. */
    Handshake(String key) {
        exchange = key.length() == 0 ? null : new KeyExchange(key);
    }

    /** Name of the client, for others. */
    String name() {
        return name;
    }

    /** Whether the client has done everything that it must before the Welcome. */
    boolean isDone() {
        return state == (exchange == null ? SessionState.HELLO : SessionState.PROVED);
    }

    /** Whether the client has said goodbye, or was refused. */
    boolean isClosed() {
        return state == SessionState.CLOSED;
    }

    /** Handle a message of the client; returns the Challenge to send, the Halt to execute, or null. */
    Message receive(int version, int type, byte[] data, int offset, int length) throws CommandRejected {
        if (version != Protocol.MAJOR && type != Halt.TYPE) {
            throw new CommandRejected(Code.WRONG_VERSION, versions(version + ".x"));
        }
        Message message = read(type, data, offset, length);
        SessionState next = SessionTransitions.next(state, type);
        if (next == null || !Messages.fromClient(type)) {
            throw new CommandRejected(Code.UNEXPECTED_MESSAGE,
                    "message " + type + " is illegal in session state " + state + "; send Hello first");
        }
        state = SessionState.CLOSED; // what is refused below opens nothing
        if (message instanceof Hello) {
            greet((Hello) message);
        } else if (message instanceof Proof && !MessageDigest.isEqual(exchange.clientMac(), ((Proof) message).mac)) {
            throw new CommandRejected(Code.WRONG_KEY, "the pre-shared key is wrong; use the one in the process data heptarm.key");
        }
        state = next;
        if (message instanceof Halt) {
            return message;
        }
        if (exchange == null) {
            return null;
        }
        exchange.add(type, data, offset, length);
        return message instanceof Hello ? challenge() : null;
    }

    private static Message read(int type, byte[] data, int offset, int length) throws CommandRejected {
        try {
            Message message = Messages.read(type, data, offset, length);
            if (message != null) {
                message.validate("");
            }
            return message;
        } catch (WireException e) {
            throw new CommandRejected(Code.BAD_BODY, "message " + type + ": " + e.getMessage());
        } catch (Violation e) {
            throw new CommandRejected(e.code, e.getMessage());
        }
    }

    private void greet(Hello message) throws CommandRejected {
        hello = message;
        String shown = PrintableText.of(message.name);
        name = shown.length() == 0 ? "a client" : shown;
        if (message.major != Protocol.MAJOR) {
            throw new CommandRejected(Code.WRONG_VERSION, versions(message.major + "." + message.minor));
        }
    }

    private Challenge challenge() {
        nonce = new byte[Protocol.NONCE];
        RANDOM.nextBytes(nonce);
        Challenge challenge = new Challenge(nonce);
        byte[] body = challenge.body();
        exchange.add(Challenge.TYPE, body, 0, body.length);
        state = SessionTransitions.next(state, Challenge.TYPE);
        return challenge;
    }

    private static String versions(String theirs) {
        return "the client speaks protocol " + theirs + ", this cabinet " + Protocol.MAJOR + "." + Protocol.MINOR
                + " (heptarm " + ServerSettings.VERSION + "); install matching versions on both";
    }

    // ------------------------------------------------------------------------------------------ the session

    /** The body of a Welcome with the cabinet's proof of the key, if there is one. */
    byte[] prove(byte[] welcome) {
        if (exchange == null) {
            return welcome;
        }
        byte[] mac = exchange.cabinetMac(Welcome.TYPE, welcome);
        byte[] whole = new byte[welcome.length + mac.length]; // the mac is the last field, so far empty
        System.arraycopy(welcome, 0, whole, 0, welcome.length);
        FrameEncoder.putInt(whole, welcome.length - 4, mac.length);
        System.arraycopy(mac, 0, whole, welcome.length, mac.length);
        return whole;
    }

    /** What the keys of the session's datagrams follow from, besides the token; with no key only the token is secret. */
    byte[] datagramSecret(byte[] token) {
        return exchange == null ? token : exchange.secret(hello.nonce, nonce);
    }

    /** A random token of datagrams. */
    static byte[] token() {
        byte[] token = new byte[Protocol.TOKEN];
        RANDOM.nextBytes(token);
        return token;
    }

    /** Tags of the client's frames after the Welcome; null: they have none. */
    FrameTag clientTag() {
        return exchange == null ? null : exchange.clientTag(hello.nonce, nonce);
    }

    /** Tags of the cabinet's frames after the Welcome; null: they have none. */
    FrameTag cabinetTag() {
        return exchange == null ? null : exchange.cabinetTag(hello.nonce, nonce);
    }
}
