package heptarm.core;

import java.io.IOException;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.ServerSocket;
import java.net.Socket;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.atomic.AtomicInteger;

import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.Encoder;
import heptarm.wire.KeyPressed;
import heptarm.wire.Message;
import heptarm.wire.Protocol;

/**
 * The cabinet's side of heptarm: accepts clients, runs their programs, pushes state, watches over all of it.
 *
 * <p>It outlives its clients: they may come and go any number of times without anybody at the smartPAD.
 */
public final class Server {
    static final int MAX_CLIENTS = 16;

    private static final int LENGTH = 6;
    /** Octets that most frames fit into, so that they are written without growing. */
    private static final int ROOM = 1024;

    final Robot robot;
    final Config config;
    final Clock clock;
    final Log log;
    final Authority authority;
    final Executor executor;
    final Warden warden;
    final Rack rack;
    final FriMonitors monitors = new FriMonitors();
    final Signals signals;
    final Sampler sampler;
    final Dispatcher dispatcher;

    private final Watchdog watchdog;
    private final List<Client> clients = new CopyOnWriteArrayList<Client>();
    private final List<Hearer> hearers = new CopyOnWriteArrayList<Hearer>();
    private final AtomicInteger sessions = new AtomicInteger();
    private ServerSocket socket;
    private Thread acceptor;
    private volatile boolean closed;

    public Server(Robot robot, Config config, Clock clock, Log log) {
        this.robot = robot;
        this.config = config;
        this.clock = clock;
        this.log = log;
        this.signals = new Signals(robot);
        this.authority = new Authority(this);
        this.executor = new Executor(this);
        this.warden = new Warden(this);
        this.rack = new Rack(robot);
        this.sampler = new Sampler(this);
        this.dispatcher = new Dispatcher(this);
        this.watchdog = new Watchdog(this);
    }

    /** Opens the port and starts the threads; returns the port. */
    public int start() throws IOException {
        socket = new ServerSocket();
        socket.setReuseAddress(true);
        socket.bind(new InetSocketAddress(InetAddress.getByName(config.bind), config.port), MAX_CLIENTS);
        begin();
        acceptor = new Thread(new Runnable() {
            public void run() {
                accept();
            }
        }, "ha-acceptor");
        acceptor.setDaemon(true);
        acceptor.start();
        log.info("heptarm " + Config.VERSION + " listens on " + config.bind + ":" + socket.getLocalPort()
                + ", protocol " + Protocol.MAJOR + "." + Protocol.MINOR);
        return socket.getLocalPort();
    }

    /** Starts the threads that move the robot and watch it; without {@link #start} there is no network. */
    void begin() {
        executor.start();
        sampler.start();
        watchdog.start();
    }

    /** Stops motion, says goodbye to all clients, closes the port, ends all threads. */
    public synchronized void close() {
        if (closed) {
            return;
        }
        closed = true;
        executor.close();
        monitors.closeAll();
        try {
            robot.stop();
        } catch (RuntimeException e) { // the port and the threads end all the same
            log.error("stopping the robot", e);
        }
        try {
            if (socket != null) {
                socket.close();
            }
        } catch (IOException e) {
            log.error("closing the port", e);
        }
        Threads.join(acceptor);
        for (Client client : clients) {
            client.goodbye(Code.SHUTTING_DOWN, "the cabinet application ends");
        }
        watchdog.close();
        sampler.close();
        for (Client client : clients) {
            client.join();
        }
    }

    /** A person beside the robot stops whatever moves. */
    public void stop(String why) {
        executor.endAll(Cause.STOPPED, why);
        robot.stop();
    }

    /** A person beside the robot has pressed or released a key for clients. */
    public void keyPressed(int slot, boolean down) {
        broadcast(new KeyPressed(slot, down));
    }

    /** A person beside the robot takes control away from whoever has it; what runs is stopped. */
    public void revokeControl(String why) {
        Client holder = authority.holder();
        if (holder != null) {
            authority.release(holder, "control was " + why);
        }
    }

    private void accept() {
        while (!closed) {
            try {
                Socket peer = socket.accept();
                peer.setTcpNoDelay(true);
                int session = sessions.incrementAndGet();
                Client client = new Client(this, peer, session);
                if (clients.size() >= MAX_CLIENTS) {
                    client.refuse(Code.TOO_MANY_CLIENTS, "this cabinet serves " + MAX_CLIENTS + " clients at a time");
                } else if (!config.allows(peer.getInetAddress().getHostAddress())) {
                    client.refuse(Code.NOT_ALLOWED, peer.getInetAddress().getHostAddress()
                            + " is not on the allow-list (process data heptarm.allow)");
                } else {
                    clients.add(client);
                    client.start();
                }
            } catch (IOException e) {
                if (!closed) {
                    log.warn("a connection was not accepted: " + e);
                    Threads.pause(); // the reason, such as too many open files, will not go away at once
                }
            } catch (RuntimeException e) {
                log.error("accepting a connection", e);
            }
        }
    }

    List<Client> clients() {
        return clients;
    }

    /** A client's connection has ended. */
    void left(Client client, String why) {
        clients.remove(client);
        retire(client, why);
    }

    /** A client gets nothing more, and controls nothing any more. */
    void retire(Client client, String why) {
        sampler.forget(client);
        if (authority.holds(client)) {
            authority.lost(client, why);
        }
    }

    /** Somebody in the cabinet itself who hears of every event, from the thread that tells it. */
    interface Hearer {
        void heard(Message event);
    }

    void listen(Hearer hearer) {
        hearers.add(hearer);
    }

    void forget(Hearer hearer) {
        hearers.remove(hearer);
    }

    /** Sends an event to every open session. */
    void broadcast(Message event) {
        for (Hearer hearer : hearers) {
            hearer.heard(event);
        }
        byte[] body = event.body();
        for (Client client : clients) {
            if (client.isOpen()) {
                client.event(event.type(), body);
            }
        }
    }

    /** A frame without its sequence number, which the client's connection fills in. */
    byte[] frame(Message message, long request) {
        Encoder out = begin(message.type(), request, ROOM);
        message.write(out);
        return measured(out.toBytes());
    }

    /** The same with a body that was written before, for many clients. */
    byte[] frame(int type, byte[] body) {
        byte[] whole = new byte[Protocol.HEADER + body.length];
        System.arraycopy(begin(type, 0, Protocol.HEADER).data(), 0, whole, 0, Protocol.HEADER);
        System.arraycopy(body, 0, whole, Protocol.HEADER, body.length);
        return measured(whole);
    }

    private Encoder begin(int type, long request, int room) {
        Encoder out = new Encoder(room);
        out.putU16(Protocol.MAGIC);
        out.putU8(Protocol.MAJOR);
        out.putU8(0);
        out.putU16(type);
        out.putU32(0);
        out.putU32(0);
        out.putU32(request);
        out.putI64(clock.nanos());
        return out;
    }

    /** Fills in the length of the body. */
    private static byte[] measured(byte[] frame) {
        int length = frame.length - Protocol.HEADER;
        for (int i = 0; i < 4; i++) {
            frame[LENGTH + i] = (byte) (length >>> 24 - 8 * i);
        }
        return frame;
    }
}
