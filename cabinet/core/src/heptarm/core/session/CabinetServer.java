package heptarm.core.session;

import java.io.IOException;
import java.util.concurrent.atomic.AtomicInteger;

import heptarm.core.Clock;
import heptarm.core.EventBus;
import heptarm.core.Log;
import heptarm.core.robot.Robot;
import heptarm.wire.Code;
import heptarm.wire.KeyPressed;
import heptarm.wire.Message;
import heptarm.wire.Protocol;
import heptarm.wire.StopKind;

/**
 * The cabinet's side of heptarm: accepts clients and connects their sessions with the robot.
 *
 * <p>It outlives its clients: they may connect and leave any number of times without an operator at the smartPAD.
 */
public final class CabinetServer implements EventBus.Listener, ClientConnection.Owner, Reception.Host {
    private final RobotService service;
    private final ServerSettings settings;
    private final Log log;
    private final FrameEncoder frames;
    private final CabinetIdentity identity;
    private final RequestDispatcher dispatcher;
    private final Reception reception;
    private final Places places;
    private final DatagramPort datagrams;
    private final AtomicInteger sessions = new AtomicInteger();
    private boolean closed;

    public CabinetServer(Robot robot, ServerSettings settings, Clock clock, Log log) {
        this.settings = settings;
        this.log = log;
        this.service = new RobotService(robot, clock, log);
        this.frames = new FrameEncoder(clock);
        this.identity = new CabinetIdentity(settings, robot, service.tools, service.authority);
        this.dispatcher = new RequestDispatcher(service.authority, service.commands, service.sampler, settings.maxRate, log);
        int room = OpenFiles.room();
        this.reception = new Reception(settings, frames, this, room, log);
        this.places = new Places(service.authority, room);
        this.datagrams = new DatagramPort(log);
        service.events.add(this);
        if (settings.reservedFor.length() > 0) {
            service.authority.reserve(settings.reservedFor);
        }
        service.watchdog.add("the places of the clients", 5, places);
        service.watchdog.add("the connections", 1, new LinkWatchdog(places.clients, service.authority, settings.heartbeat, clock));
    }

    /** Open the port and start the threads; returns the port. */
    public int start() throws IOException {
        int port = reception.open();
        service.start();
        openDatagrams(port);
        reception.start();
        String sources = ServerSettings.SOURCES.length() > 0 ? " (sources " + ServerSettings.SOURCES + ")" : "";
        log.info("heptarm " + ServerSettings.VERSION + sources + " listens on " + settings.bind + ":" + port + ", TCP "
                + (datagrams.isOpen() ? "and UDP" : "only") + ", protocol " + Protocol.MAJOR + "." + Protocol.MINOR);
        if (settings.isOpenToAll()) {
            log.warn("any program in the network can move this robot: set the process data heptarm.key or heptarm.allow");
        }
        return port;
    }

    /** Open the UDP port of the same number; everything works without it. */
    private void openDatagrams(int port) {
        if (!settings.datagrams) {
            return;
        }
        try {
            datagrams.open(settings.bind, port);
        } catch (IOException e) {
            log.warn(withoutUdp(port, e));
        } catch (RuntimeException e) { // forbidden on this cabinet
            log.warn(withoutUdp(port, e));
        }
    }

    private static String withoutUdp(int port, Exception why) {
        return "UDP port " + port + " cannot be opened (" + why.getMessage() + "): servo targets and states go over TCP";
    }

    /** Stop motion, say goodbye to all clients, close the port, end all threads. */
    public synchronized void close() {
        if (closed) {
            return;
        }
        closed = true;
        service.stopMotion();
        reception.close();
        for (ClientConnection client : places.clients) {
            client.goodbye(Code.SHUTTING_DOWN, "the cabinet application is closing");
        }
        service.endThreads();
        datagrams.close();
        for (ClientConnection client : places.clients) {
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

    public void admit(Newcomer newcomer) throws IOException {
        ClientConnection client = new ClientConnection(newcomer, sessions.incrementAndGet(), identity, dispatcher, this, frames,
                datagrams, service.clock, log);
        places.add(client);
        client.start();
    }

    public void halt(StopKind kind, String who) {
        log.info(who + " stops the arm, without a session");
        service.commands.stop(kind, "from " + who + ", without a session", true);
    }

    /** Sends an event to every open session. */
    public void received(Message event) {
        byte[] body = event.body();
        for (ClientConnection client : places.clients) {
            if (client.isOpen()) {
                client.outbox.event(event.type(), body);
            }
        }
    }

    public void closed(ClientConnection client, String why) {
        places.remove(client);
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
