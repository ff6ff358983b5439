package heptarm.core.session;

import java.util.List;

import heptarm.core.Clock;
import heptarm.core.safety.Watchdog;
import heptarm.wire.Code;
import heptarm.wire.Ping;

/** Checks the connections: silent clients, stuck connections, and heartbeats that are due. */
final class LinkWatchdog implements Watchdog.Check {
    /** Longest write to a client [s]. */
    private static final double MAX_WRITE = 2.0;
    private static final int SILENT_HEARTBEATS = 5;
    /** Longest silence over TCP while datagrams arrive [s]. */
    private static final double MAX_TCP_SILENCE = 10.0;

    private final List<ClientConnection> clients;
    private final ControlAuthority authority;
    private final double heartbeat;
    private final Clock clock;

    LinkWatchdog(List<ClientConnection> clients, ControlAuthority authority, double heartbeat, Clock clock) {
        this.clients = clients;
        this.authority = authority;
        this.heartbeat = heartbeat;
        this.clock = clock;
    }

    public boolean isIdle() {
        return !authority.isHeld(); // silence of others may be noticed a little later
    }

    public void check() {
        long now = clock.nanos();
        double scale = 1e-9 / clock.rate(); // time-outs of the link are in the client's seconds
        for (ClientConnection client : clients) {
            client.datagrams.ping();
            double silence = client.silence.confirmed(client.datagrams.heard()) * scale;
            long writing = client.sent.began();
            if (writing != 0 && (now - writing) * scale > MAX_WRITE) {
                client.leave("it does not read what it subscribed to");
            } else if (silence > SILENT_HEARTBEATS * heartbeat) {
                client.goodbye(Code.SILENT, "silent for " + Math.round(silence * 1000) + " ms, at most "
                        + Math.round(SILENT_HEARTBEATS * heartbeat * 1000) + " ms are allowed");
            } else if (client.silence.overTcp() * scale > Math.max(MAX_TCP_SILENCE, 2 * SILENT_HEARTBEATS * heartbeat)) {
                client.goodbye(Code.SILENT, "only datagrams came for " + Math.round(client.silence.overTcp() * scale) + " s");
            } else if (authority.isController(client) && silence > authority.watchdog()) {
                authority.lost(client, "silent for " + Math.round(silence * 1000) + " ms, its watchdog time is "
                        + Math.round(authority.watchdog() * 1000) + " ms");
            } else if ((now - client.sent.lastSent()) * scale > heartbeat) {
                client.outbox.event(Ping.TYPE, new Ping(now).body());
            }
        }
    }
}
