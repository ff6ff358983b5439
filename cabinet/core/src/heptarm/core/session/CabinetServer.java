package heptarm.core.session;

import java.io.IOException;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.ServerSocket;
import java.net.Socket;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.atomic.AtomicInteger;

import heptarm.core.Clock;
import heptarm.core.EventBus;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.core.robot.Robot;
import heptarm.wire.Code;
import heptarm.wire.KeyPressed;
import heptarm.wire.Message;
import heptarm.wire.Protocol;

/**
 * The cabinet's side of heptarm: accepts clients and connects their sessions with the robot.
 *
 * <p>It outlives its clients: they may connect and leave any number of times without an operator at the smartPAD.
 */
public final class CabinetServer implements EventBus.Listener, ClientConnection.Owner {
    private static final int MAX_CLIENTS = 16;

    private final RobotService service;
    private final ServerSettings settings;
    private final Log log;
    private final FrameEncoder frames;
    private final CabinetIdentity identity;
    private final RequestDispatcher dispatcher;
    private final List<ClientConnection> clients = new CopyOnWriteArrayList<ClientConnection>();
    private final AtomicInteger sessions = new AtomicInteger();
    private ServerSocket socket;
    private Thread acceptor;
    private volatile boolean closed;

    public CabinetServer(Robot robot, ServerSettings settings, Clock clock, Log log) {
        this.settings = settings;
        this.log = log;
        this.service = new RobotService(robot, clock, log);
        this.frames = new FrameEncoder(clock);
        this.identity = new CabinetIdentity(settings, robot, service.tools, service.authority);
        this.dispatcher = new RequestDispatcher(service.authority, service.commands, service.sampler, settings.maxRate, log);
        service.events.add(this);
        service.watchdog.add("the connections", 1, new LinkWatchdog(clients, service.authority, settings.heartbeat, clock));
    }

    /** Open the port and start the threads; returns the port. */
    public int start() throws IOException {
        socket = new ServerSocket();
        socket.setReuseAddress(true);
        socket.bind(new InetSocketAddress(InetAddress.getByName(settings.bind), settings.port), MAX_CLIENTS);
        service.start();
        acceptor = Threads.start("ha-acceptor", new Runnable() {
            public void run() {
                accept();
            }
        });
        log.info("heptarm " + ServerSettings.VERSION + " listens on " + settings.bind + ":" + socket.getLocalPort()
                + ", protocol " + Protocol.MAJOR + "." + Protocol.MINOR);
        return socket.getLocalPort();
    }

    /** Stop motion, say goodbye to all clients, close the port, end all threads. */
    public synchronized void close() {
        if (closed) {
            return;
        }
        closed = true;
        service.stopMotion();
        try {
            if (socket != null) {
                socket.close();
            }
        } catch (IOException e) {
            log.error("closing the port", e);
        }
        Threads.join(acceptor);
        for (ClientConnection client : clients) {
            client.goodbye(Code.SHUTTING_DOWN, "the cabinet application is closing");
        }
        service.endThreads();
        for (ClientConnection client : clients) {
            client.join();
        }
    }

    /** An operator stops whatever moves. */
    public void stop(String why) {
        service.stop(why);
    }

    /** An operator has pressed or released a user key for clients. */
    public void keyPressed(int slot, boolean down) {
        service.events.publish(new KeyPressed(slot, down));
    }

    /** An operator takes control away from its holder; motions are stopped. */
    public void revokeControl(String why) {
        service.authority.revoke("control was " + why);
    }

    private void accept() {
        while (!closed) {
            try {
                Socket peer = socket.accept();
                peer.setTcpNoDelay(true);
                ClientConnection client = new ClientConnection(peer, sessions.incrementAndGet(), identity, dispatcher, this, frames,
                        service.clock, log);
                String address = peer.getInetAddress().getHostAddress();
                if (clients.size() >= MAX_CLIENTS) {
                    client.refuse(Code.TOO_MANY_CLIENTS, "at most " + MAX_CLIENTS + " clients may be connected; disconnect one of them");
                } else if (!settings.allows(address)) {
                    client.refuse(Code.NOT_ALLOWED, address + " is not on the allow-list; add it to the process data heptarm.allow");
                } else {
                    clients.add(client);
                    client.start();
                }
            } catch (IOException e) {
                if (!closed) {
                    log.warn("a connection was not accepted: " + e);
                    Threads.pause(); // a cause such as too many open files does not vanish at once
                }
            } catch (RuntimeException e) {
                log.error("accepting a connection", e);
            }
        }
    }

    /** Sends an event to every open session. */
    public void received(Message event) {
        byte[] body = event.body();
        for (ClientConnection client : clients) {
            if (client.isOpen()) {
                client.event(event.type(), body);
            }
        }
    }

    public void closed(ClientConnection client, String why) {
        clients.remove(client);
        ending(client, 0, why);
    }

    public void ending(ClientConnection client, int code, String why) {
        service.sampler.unsubscribe(client);
        if (!service.authority.isController(client)) {
            return;
        }
        if (code == Code.FORGED_FRAME || code == Code.BAD_FRAME) {
            service.authority.distrust(client, why);
        } else {
            service.authority.lost(client, why);
        }
    }
}
