package heptarm.core;

import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.ControlChanged;
import heptarm.wire.OnLost;

/** Who controls the robot: one client at most. A controller that is lost or silent loses control and the arm stops. */
final class Authority {
    private final Server server;
    private Client holder;
    private double watchdog;
    private OnLost onLost;
    private boolean leaving;

    Authority(Server server) {
        this.server = server;
    }

    synchronized void take(Client client, double watchdogSeconds, OnLost whenLost) throws Refusal {
        if (!client.isOpen()) {
            throw new Refusal(Code.NOT_IN_CONTROL, "the connection of " + client.name() + " has ended");
        }
        if (holder != null && (holder != client || leaving)) {
            throw new Refusal(Code.CONTROL_TAKEN, "controller", holder.name(), "",
                    holder.name() + " (session " + holder.session + ") controls this robot");
        }
        boolean changed = holder == null;
        if (changed && server.executor.status()[0] == 0) {
            // a pause and the override belong to a controller; the next one begins without them
            if (!server.warden.isHolding()) { // a stop is another matter
                server.robot.resume();
            }
            server.robot.setOverride(1.0);
        }
        holder = client;
        watchdog = watchdogSeconds;
        onLost = whenLost;
        if (changed) {
            server.broadcast(new ControlChanged(client.name(), client.session, "took control"));
        }
    }

    void release(Client client, String why) {
        synchronized (this) {
            if (holder != client || leaving) {
                return;
            }
            leaving = true;
        }
        try {
            server.executor.endAll(Cause.STOPPED, why);
            server.monitors.closeAll();
        } finally {
            free(why);
        }
    }

    /** Control is free only when everything of its holder was ended, so that nothing of the next one's is. */
    private synchronized void free(String why) {
        server.broadcast(new ControlChanged("", 0, why));
        holder = null;
        leaving = false;
    }

    /** The controller is gone or silent. */
    void lost(Client client, String why) {
        OnLost what;
        synchronized (this) {
            if (holder != client || leaving) {
                return;
            }
            leaving = true;
            what = onLost;
        }
        server.log.warn(client.name() + " lost control: " + why);
        try {
            if (what == OnLost.STOP) {
                server.executor.endAll(Cause.LOST, client.name() + " was lost: " + why);
                server.robot.stop();
            }
            server.monitors.closeAll();
        } catch (RuntimeException e) {
            server.log.error("stopping the robot", e);
        } finally {
            free(client.name() + " was lost: " + why);
        }
    }

    synchronized boolean holds(Client client) {
        return holder == client && !leaving;
    }

    synchronized Client holder() {
        return holder;
    }

    synchronized String name() {
        return holder == null ? "" : holder.name();
    }

    /** Silence [s] after which the controller counts as lost. */
    synchronized double watchdog() {
        return watchdog;
    }
}
