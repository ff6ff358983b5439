package heptarm.core;

import java.security.GeneralSecurityException;
import java.security.MessageDigest;
import java.security.SecureRandom;

import javax.crypto.Mac;
import javax.crypto.spec.SecretKeySpec;

import heptarm.wire.Challenge;
import heptarm.wire.Code;
import heptarm.wire.Encoder;
import heptarm.wire.Groups;
import heptarm.wire.Hello;
import heptarm.wire.Message;
import heptarm.wire.Messages;
import heptarm.wire.Proof;
import heptarm.wire.Protocol;
import heptarm.wire.Violation;
import heptarm.wire.FrameInfo;
import heptarm.wire.RobotInfo;
import heptarm.wire.SignalInfo;
import heptarm.wire.ToolInfo;
import heptarm.wire.Welcome;
import heptarm.wire.WireException;

/** The first frames of a connection: versions, the key, the welcome. */
final class Handshake {
    private static final SecureRandom RANDOM = new SecureRandom();
    private static final int ALL_GROUPS = Groups.JOINTS | Groups.TORQUES | Groups.POSE | Groups.WRENCH | Groups.MOTION
            | Groups.SAFETY | Groups.IO | Groups.MODE;

    private final Server server;
    private final Client client;
    private volatile boolean open;
    private String name = "a client";
    private Hello hello;
    private byte[] nonce;

    Handshake(Server server, Client client) {
        this.server = server;
        this.client = client;
    }

    boolean isOpen() {
        return open;
    }

    String name() {
        return name;
    }

    /** One frame before the session stands; anything but the right one ends the connection with a reason. */
    void handle(int version, int type, byte[] data, int offset, int length) {
        try {
            step(version, type, data, offset, length);
        } catch (Refusal e) {
            refuse(e.code, e.getMessage());
        }
    }

    private void step(int version, int type, byte[] data, int offset, int length) throws Refusal {
        if (version != Protocol.MAJOR) {
            throw new Refusal(Code.WRONG_VERSION, versions(version + ".x"));
        }
        Message message;
        try {
            message = Messages.read(type, data, offset, length);
            if (message != null) {
                message.validate("");
            }
        } catch (WireException e) {
            throw new Refusal(Code.BAD_BODY, "message " + type + ": " + e.getMessage());
        } catch (Violation e) {
            throw new Refusal(e.code, e.getMessage());
        }
        if (message instanceof Hello && hello == null) {
            greet((Hello) message);
        } else if (message instanceof Proof && nonce != null) {
            prove((Proof) message);
        } else {
            throw new Refusal(Code.UNEXPECTED_MESSAGE, "message " + type + " before the session stands; say Hello first");
        }
    }

    private void greet(Hello message) throws Refusal {
        hello = message;
        name = message.name.length() == 0 ? "a client" : message.name;
        if (message.major != Protocol.MAJOR) {
            throw new Refusal(Code.WRONG_VERSION, versions(message.major + "." + message.minor));
        }
        if (server.config.key.length() == 0) {
            welcome();
            return;
        }
        nonce = new byte[32];
        RANDOM.nextBytes(nonce);
        client.answer(new Challenge(nonce), 0);
    }

    private void prove(Proof proof) throws Refusal {
        if (!MessageDigest.isEqual(mac(nonce, hello.nonce), proof.mac)) {
            throw new Refusal(Code.WRONG_KEY, "the pre-shared key is wrong");
        }
        welcome();
    }

    private static String versions(String theirs) {
        return "the client speaks protocol " + theirs + ", this cabinet " + Protocol.MAJOR + "." + Protocol.MINOR
                + " (heptarm " + Config.VERSION + "); install matching versions on both";
    }

    private byte[] mac(byte[] first, byte[] second) {
        try {
            Mac mac = Mac.getInstance("HmacSHA256");
            mac.init(new SecretKeySpec(Encoder.utf8(server.config.key), "HmacSHA256"));
            mac.update(first);
            return mac.doFinal(second);
        } catch (GeneralSecurityException e) {
            throw new IllegalStateException("no HMAC-SHA-256", e);
        }
    }

    private void welcome() {
        Robot robot = server.robot;
        byte[] proof = nonce == null ? new byte[0] : mac(hello.nonce, nonce);
        RobotInfo info = robot.info();
        String cabinet = robot.cabinet();
        String[] capabilities = robot.capabilities();
        ToolInfo[] tools = server.rack.known();
        FrameInfo[] frames = robot.frames();
        SignalInfo[] signals = robot.signals();
        boolean isVirtual = robot.isVirtual();
        if (!client.claim()) {
            return; // the cabinet application ends
        }
        open = true; // events of others gather from here on; the welcome still comes first and knows all before them
        client.writeClaimed(server.frame(new Welcome(Protocol.MAJOR, Protocol.MINOR, client.session, Config.VERSION, cabinet,
                isVirtual, info, capabilities, tools, frames, signals, ALL_GROUPS, server.config.maxRate,
                server.config.heartbeat, server.authority.name(), proof), 0));
    }

    void refuse(int code, String text) {
        client.answer(new heptarm.wire.Refusal(code, text, Protocol.MAJOR, Protocol.MINOR), 0);
        client.endAfterWriting();
    }
}
