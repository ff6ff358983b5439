package heptarm.core.session;

import java.io.IOException;
import java.io.InputStream;
import java.net.Socket;

import heptarm.core.Clock;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.core.state.StateSampler;
import heptarm.wire.State;
import heptarm.wire.Welcome;

/**
 * The session of one client, from its Welcome to the end of its connection.
 *
 * <p><b>Parts.</b> {@link ReceivedFrames} makes frames of the client's bytes and refuses each that is not the next one of that
 * client. {@link RequestDispatcher} handles them. {@link Outbox} has what waits to be sent and decides who may write;
 * {@link SentFrames} writes it. {@link Silence} knows for how long the client has been silent, and {@link SessionDatagrams}
 * is the UDP beside the connection. This class owns the socket and the two threads, and ends all of it once.
 *
 * <p><b>Stages.</b>
 * <pre>
 *   new --start()--> welcomed --goodbye()--> ending --writer is done--> closed
 *                       |                      |                          ^
 *                       +-------- leave(): the socket is closed at once --+
 * </pre>
 * The handshake is over before: Reception and Newcomer have checked Hello and key, and hand over the socket with the bytes
 * that came behind Hello. The session is open from the moment in which events are queued for it, which is before the state
 * of the robot is read for the Welcome: an event in between is then sent after the Welcome, and none is lost. Ending
 * means: no request is handled, no state is sent, control is given up; what is queued and the Goodbye still go out, and the
 * client's bytes are read and discarded, because a socket that is closed with unread bytes resets the connection and would
 * take the Goodbye with it. Closed is final. {@link Owner#ending} is called when control has to be given up, by goodbye()
 * and by leave(), and has to bear being called twice; {@link Owner#closed} is called once.
 *
 * <p><b>Threads.</b>
 * <ul>
 * <li>The reader's thread (ha-reader-N) waits in the socket, handles each request to its end, and writes the answer itself if
 * the outbox is free. A request that waits for the robot therefore delays the requests behind it, and nothing else.
 * <li>The writer's thread (ha-writer-N) waits in the outbox and writes what was queued. It is the only one that waits for
 * a client that does not read, beside a reader or sampler that has begun to write: LinkWatchdog closes the socket under a
 * write that takes too long.
 * <li>The sampler's thread offers states: to the datagrams, else to the outbox, where it writes itself only if this is the
 * only subscriber ({@link #receiveAlone}) and the last time did not take long.
 * <li>Any thread may queue an event, call goodbye() and leave(). None of them waits for the client.
 * <li>The watchdog's thread asks for silence, sends heartbeats, and ends what is silent or stuck.
 * <li>The thread of the UDP port brings datagrams to SessionDatagrams, which decides whether they count.
 * </ul>
 *
 * <p><b>Locks.</b> The outbox has one and calls nobody under it, so that the owner may call back and may hold locks of its
 * own. The datagrams have one for opening, and one under which a request by datagram is handled, so that its twin over TCP
 * comes after it. What only one thread uses has none: ReceivedFrames belongs to the reader's thread, SentFrames to the thread
 * that has the outbox.
 *
 * <p><b>Why it does not simply queue everything.</b> Waking a second thread costs as much as all the rest of an answer, so
 * answers and single states are written where they are made. Events are queued always: their thread may hold the robot's locks.
 */
final class ClientConnection implements ControlAuthority.Controller, StateSampler.Subscriber, Outbox.Owner {
    private static final long LINGER_MS = 500;

    final SentFrames sent;
    final Outbox outbox;
    final Silence silence;
    final SessionDatagrams datagrams;
    private final ReceivedFrames received;
    private final int session;
    private final Socket socket;
    private final InputStream in;
    private final Handshake handshake;
    private final CabinetIdentity identity;
    private final RequestDispatcher dispatcher;
    private final Owner owner;
    private final FrameEncoder frames;
    private final Log log;
    private volatile boolean welcomed;
    private Thread reading;
    private Thread writing;

    /** Receives the end of a connection. */
    interface Owner {
        /** The client receives no more states and events, and controls nothing any more; code: of the Goodbye, 0: none. */
        void ending(ClientConnection client, int code, String why);

        /** The connection is closed. */
        void closed(ClientConnection client, String why);
    }

    ClientConnection(Newcomer newcomer, int session, CabinetIdentity identity, RequestDispatcher dispatcher, Owner owner,
            FrameEncoder frames, DatagramPort port, Clock clock, Log log) throws IOException {
        this.session = session;
        this.socket = newcomer.socket;
        this.in = socket.getInputStream();
        this.handshake = newcomer.handshake;
        this.identity = identity;
        this.dispatcher = dispatcher;
        this.owner = owner;
        this.frames = frames;
        this.log = log;
        this.received = new ReceivedFrames(newcomer.unread(), newcomer.received());
        this.sent = new SentFrames(socket.getOutputStream(), newcomer.sent(), clock);
        this.outbox = new Outbox(sent, frames, this);
        this.silence = new Silence(in, clock);
        this.datagrams = new SessionDatagrams(this, socket.getInetAddress(), handshake, port, dispatcher, frames, clock);
    }

    void start() {
        reading = thread("ha-reader-" + session, new Runnable() {
            public void run() {
                readAll();
            }
        });
        writing = thread("ha-writer-" + session, new Runnable() {
            public void run() {
                writeAll();
            }
        });
        writing.start();
        reading.start();
    }

    private static Thread thread(String name, Runnable body) {
        Thread thread = new Thread(body, name);
        thread.setDaemon(true);
        return thread;
    }

    public String name() {
        return handshake.name();
    }

    public int session() {
        return session;
    }

    public boolean isOpen() {
        return welcomed && outbox.isOpen();
    }

    /** Its address without the port. */
    String host() {
        return socket.getInetAddress().getHostAddress();
    }

    String address() {
        return String.valueOf(socket.getRemoteSocketAddress());
    }

    // ------------------------------------------------------------------------------------------- the reader's thread

    private void readAll() {
        String why = "the connection was closed";
        try {
            welcome();
            handleFrames(); // a client without a key may say more than Hello at once
            while (!outbox.isClosed() && received.read(in)) {
                silence.bytes(received.isTagged());
                handleFrames();
            }
        } catch (IOException e) {
            why = Outbox.broken(e);
        } catch (RuntimeException e) {
            why = "an error in the cabinet application: " + e;
            log.error("serving " + address(), e);
        } finally {
            leave(why);
        }
    }

    /** Open the session: the Welcome goes out first, and reflects all events before it; every later frame has a tag. */
    private void welcome() {
        if (!outbox.take()) {
            return;
        }
        received.require(handshake.clientTag()); // before the Welcome, after which the client sends tagged frames
        welcomed = true; // events are queued from here on
        byte[] body = handshake.prove(identity.welcome(session).body());
        outbox.writeFirst(frames.frame(Welcome.TYPE, body), handshake.cabinetTag());
    }

    private void handleFrames() {
        try {
            while (outbox.isOpen()) {
                if (!received.next()) {
                    return;
                }
                silence.frame();
                datagrams.requested(received.type, received.request);
                dispatcher.handle(this, received.type, received.request, received.stamp, received.data, received.body, received.length);
            }
        } catch (ReceivedFrames.Refused e) {
            goodbye(e.code, e.getMessage());
        }
        received.discard();
    }

    // ------------------------------------------------------------------------------------------- the writer's thread

    private void writeAll() {
        try {
            outbox.writeAll();
            linger();
            leave("the session was ended");
        } catch (IOException e) {
            leave(Outbox.broken(e));
        } catch (InterruptedException e) {
            leave("the cabinet application is closing");
        }
    }

    /** Close the sending side, and wait briefly for the client to close its side. */
    private void linger() throws IOException, InterruptedException {
        if (!outbox.isClosed()) {
            socket.shutdownOutput();
            outbox.awaitClosed(LINGER_MS);
        }
    }

    // ------------------------------------------------------------------------------------------- the sampler's thread

    public void receive(State state) {
        if (!datagrams.offer(state)) {
            outbox.state(frames.frame(state, 0));
        }
    }

    public void receiveAlone(State state) {
        if (!datagrams.offer(state)) {
            outbox.stateAtOnce(frames.frame(state, 0));
        }
    }

    public void miss(long count) {
        outbox.miss(count);
    }

    // ------------------------------------------------------------------------------------------- the end

    /** Send a Goodbye with a reason, then end the connection. */
    void goodbye(int code, String text) {
        if (outbox.end(code, text)) {
            owner.ending(this, code, text);
        }
    }

    /** End the connection at once. */
    public void leave(String why) {
        if (!outbox.close()) {
            return;
        }
        datagrams.close();
        try {
            socket.close();
        } catch (IOException e) {
            log.warn("closing " + address() + ": " + e);
        }
        owner.closed(this, why);
        long missed = outbox.missed();
        if (missed > 0) {
            log.info(missed + " states were due for " + name() + " and were not sent: it reads too slowly, or they were sampled late");
        }
    }

    void join() {
        Threads.join(writing);
        leave("the cabinet application is closing");
        Threads.join(reading);
    }
}
