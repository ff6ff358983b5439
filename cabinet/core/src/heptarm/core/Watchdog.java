package heptarm.core;

import heptarm.wire.Code;
import heptarm.wire.Ping;

/** Watches over the clients and the robot: silence, stuck connections, changes of the safety state. */
final class Watchdog {
    private static final long PERIOD_NS = 10000000L;
    private static final double STUCK = 2.0;
    private static final double HANDSHAKE = 5.0;
    private static final int SILENT_HEARTBEATS = 5;
    private static final int SAFETY_EVERY = 5;

    private final Server server;
    private Thread thread;
    private volatile boolean closed;

    Watchdog(Server server) {
        this.server = server;
    }

    void start() {
        thread = new Thread(new Runnable() {
            public void run() {
                work();
            }
        }, "ha-watchdog");
        thread.setDaemon(true);
        thread.start();
    }

    void close() {
        closed = true;
        Threads.end(thread);
    }

    private void work() {
        int round = 0;
        boolean failing = false;
        try {
            while (!closed) {
                server.clock.sleepUntil(server.clock.nanos() + PERIOD_NS); // a true pause, also after a hold-up
                try {
                    look();
                    server.monitors.look();
                    if (++round % SAFETY_EVERY == 0) {
                        server.warden.look();
                        failing = false;
                    }
                } catch (RuntimeException e) {
                    if (!failing) {
                        server.log.error("watching", e);
                    }
                    failing = true;
                }
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private void look() {
        long now = server.clock.nanos();
        double scale = 1e-9 / server.clock.rate(); // time-outs of the link count the client's seconds
        for (Client client : server.clients()) {
            double silence = client.silence() * scale;
            long began = client.writeBegan();
            if (began != 0 && (now - began) * scale > STUCK) {
                client.leave("it does not read what it asked for");
            } else if (client.isNew()) {
                if ((now - client.born()) * scale > HANDSHAKE) { // counted from its start: octets now and then are no Hello
                    client.leave("it never said Hello");
                }
            } else if (silence > SILENT_HEARTBEATS * server.config.heartbeat) {
                client.goodbye(Code.SILENT, "nothing was heard for " + Math.round(silence * 1000) + " ms");
            } else if (server.authority.holds(client) && silence > server.authority.watchdog()) {
                server.authority.lost(client, "silent for " + Math.round(silence * 1000) + " ms, its watchdog time is "
                        + Math.round(server.authority.watchdog() * 1000) + " ms");
            } else if ((now - client.sent()) * scale > server.config.heartbeat) {
                client.event(Ping.TYPE, new Ping(now).body());
            }
        }
    }
}
