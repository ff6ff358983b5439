package heptarm.core.session;

import java.security.MessageDigest;
import java.security.SecureRandom;

import heptarm.core.CommandRejected;
import heptarm.core.key.FrameTag;
import heptarm.core.key.KeyExchange;
import heptarm.wire.Challenge;
import heptarm.wire.Code;
import heptarm.wire.Hello;
import heptarm.wire.Message;
import heptarm.wire.Messages;
import heptarm.wire.Proof;
import heptarm.wire.Protocol;
import heptarm.wire.Refusal;
import heptarm.wire.SessionState;
import heptarm.wire.SessionTransitions;
import heptarm.wire.Violation;
import heptarm.wire.Welcome;
import heptarm.wire.WireException;

/** The first frames of a connection: versions, the key, the Welcome. The schema's table lists which message is legal when. */
final class Handshake {
    private static final SecureRandom RANDOM = new SecureRandom();

    private final CabinetIdentity identity;
    private final ClientConnection client;
    private volatile SessionState state = SessionState.START;
    private String name = "a client";
    private Hello hello;
    private byte[] nonce;
    private KeyExchange exchange;

    Handshake(CabinetIdentity identity, ClientConnection client) {
        this.identity = identity;
        this.client = client;
    }

    boolean isOpen() {
        return state == SessionState.OPEN;
    }

    String name() {
        return name;
    }

    /** Handle one frame of a session that is not open yet; an illegal one ends the connection with a reason. */
    void handle(int version, int type, byte[] data, int offset, int length) {
        try {
            step(version, type, data, offset, length);
        } catch (CommandRejected e) {
            refuse(e.code, e.getMessage());
        }
    }

    private void step(int version, int type, byte[] data, int offset, int length) throws CommandRejected {
        if (version != Protocol.MAJOR) {
            throw new CommandRejected(Code.WRONG_VERSION, versions(version + ".x"));
        }
        Message message = read(type, data, offset, length);
        SessionState next = SessionTransitions.next(state, type);
        if (next == null || !Messages.fromClient(type)) {
            throw new CommandRejected(Code.UNEXPECTED_MESSAGE,
                    "message " + type + " is illegal in session state " + state + "; send Hello first");
        }
        state = next;
        if (message instanceof Hello && identity.key().length() > 0) {
            exchange = new KeyExchange(identity.key());
        }
        if (exchange != null && message instanceof Hello) {
            exchange.add(type, data, offset, length);
        }
        if (message instanceof Hello) {
            greet((Hello) message);
        } else if (message instanceof Proof) {
            verify((Proof) message);
            exchange.add(type, data, offset, length);
            welcome();
        } else {
            client.leave("it said goodbye");
        }
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
        name = message.name.length() == 0 ? "a client" : message.name;
        if (message.major != Protocol.MAJOR) {
            throw new CommandRejected(Code.WRONG_VERSION, versions(message.major + "." + message.minor));
        }
        if (exchange == null) {
            welcome();
            return;
        }
        nonce = new byte[Protocol.NONCE];
        RANDOM.nextBytes(nonce);
        Challenge challenge = new Challenge(nonce);
        byte[] body = challenge.body();
        exchange.add(Challenge.TYPE, body, 0, body.length);
        sent(Challenge.TYPE);
        client.answer(challenge, 0);
    }

    private void verify(Proof proof) throws CommandRejected {
        if (!MessageDigest.isEqual(exchange.clientMac(), proof.mac)) {
            throw new CommandRejected(Code.WRONG_KEY, "the pre-shared key is wrong; use the one in the process data heptarm.key");
        }
    }

    private static String versions(String theirs) {
        return "the client speaks protocol " + theirs + ", this cabinet " + Protocol.MAJOR + "." + Protocol.MINOR
                + " (heptarm " + ServerSettings.VERSION + "); install matching versions on both";
    }

    private void welcome() {
        if (!client.claim()) {
            return; // the cabinet application is closing
        }
        sent(Welcome.TYPE); // events are queued from here on; the Welcome goes out first and reflects all earlier ones
        byte[] body = identity.welcome(client.session()).body();
        FrameTag theirs = null;
        FrameTag ours = null;
        if (exchange != null) {
            body = withMac(body, exchange.cabinetMac(Welcome.TYPE, body));
            theirs = exchange.clientTag(hello.nonce, nonce);
            ours = exchange.cabinetTag(hello.nonce, nonce);
        }
        client.open(body, theirs, ours);
    }

    /** The body of a Welcome, whose last field is an empty mac, with its mac. */
    private static byte[] withMac(byte[] body, byte[] mac) {
        byte[] whole = new byte[body.length + mac.length];
        System.arraycopy(body, 0, whole, 0, body.length);
        FrameEncoder.putInt(whole, body.length - 4, mac.length);
        System.arraycopy(mac, 0, whole, body.length, mac.length);
        return whole;
    }

    void refuse(int code, String text) {
        sent(Refusal.TYPE);
        client.answer(new Refusal(code, text, Protocol.MAJOR, Protocol.MINOR), 0);
        client.endAfterWriting();
    }

    /** This side sends a message of the handshake. */
    private void sent(int type) {
        SessionState next = SessionTransitions.next(state, type);
        state = next == null ? SessionState.CLOSED : next;
    }
}
