package heptarm.core.session;

import heptarm.core.CommandRejected;
import heptarm.core.EventBus;
import heptarm.core.Log;
import heptarm.core.motion.FriMonitors;
import heptarm.core.motion.MotionExecutor;
import heptarm.core.robot.MotionPort;
import heptarm.core.safety.SafetyMonitor;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.ControlChanged;
import heptarm.wire.OnLost;

/** Who controls the robot: one client at most. A controller that is lost or silent loses control, and the arm stops. */
public final class ControlAuthority {
    /** Of a program of the cabinet; sessions of clients count from 1. */
    private static final int NO_SESSION = 0;

    private final MotionPort port;
    private final MotionExecutor executor;
    private final FriMonitors monitors;
    private final SafetyMonitor safety;
    private final EventBus events;
    private final Log log;
    private Controller controller;
    private double watchdog;
    private OnLost onLost;
    private boolean leaving;
    private boolean isPausedByClient;

    /** A session that may control the robot. */
    interface Controller {
        String name();

        int session();

        boolean isOpen();
    }

    ControlAuthority(MotionPort port, MotionExecutor executor, FriMonitors monitors, SafetyMonitor safety, EventBus events, Log log) {
        this.port = port;
        this.executor = executor;
        this.monitors = monitors;
        this.safety = safety;
        this.events = events;
        this.log = log;
    }

    /** Gives control to another program of the cabinet for good: clients may only observe and stop the robot. */
    synchronized void reserve(final String program) {
        controller = new Controller() {
            public String name() {
                return program;
            }

            public int session() {
                return NO_SESSION;
            }

            public boolean isOpen() {
                return true;
            }
        };
    }

    synchronized void take(Controller client, double watchdogSeconds, OnLost whenLost) throws CommandRejected {
        if (!client.isOpen()) {
            throw new CommandRejected(Code.NOT_IN_CONTROL, "the connection of " + client.name() + " has ended; connect again");
        }
        if (controller != null && (controller != client || leaving)) {
            if (controller.session() == NO_SESSION) {
                throw new CommandRejected(Code.CONTROL_TAKEN, "controller", controller.name(), "", "the application "
                        + controller.name() + " controls this robot: observe it with control=False");
            }
            throw new CommandRejected(Code.CONTROL_TAKEN, "controller", controller.name(), "",
                    controller.name() + " (session " + controller.session() + ") controls this robot");
        }
        boolean changed = controller == null;
        if (changed && executor.status().id == 0) {
            // a client's pause and the speed override belong to a controller; the next one starts without them
            if (isPausedByClient && !safety.isHolding()) { // a stop must stay, and so must the operator's pause
                port.resume();
            }
            isPausedByClient = false;
            port.setOverride(1.0);
        }
        controller = client;
        watchdog = watchdogSeconds;
        onLost = whenLost;
        if (changed) {
            events.publish(new ControlChanged(client.name(), client.session(), "took control"));
        }
    }

    /** A client has paused the robot, or lets it go on. */
    synchronized void paused(boolean byClient) {
        isPausedByClient = byClient;
    }

    void release(Controller client, String why) {
        synchronized (this) {
            if (controller != client || leaving) {
                return;
            }
            leaving = true;
        }
        try {
            executor.endAll(Cause.STOPPED, why);
            monitors.closeAll();
        } finally {
            free(why);
        }
    }

    /** Takes control away from the controller, if there is one. */
    void revoke(String why) {
        Controller holder;
        synchronized (this) {
            holder = controller;
        }
        if (holder != null) {
            release(holder, why);
        }
    }

    /** Frees control after everything of the controller has ended: nothing of the next one's may end with it. */
    private synchronized void free(String why) {
        events.publish(new ControlChanged("", 0, why));
        controller = null;
        leaving = false;
    }

    /** The controller is gone or silent. */
    void lost(Controller client, String why) {
        OnLost action;
        synchronized (this) {
            action = onLost;
        }
        lose(client, action, why);
    }

    /** What arrives from the controller is not what it sent: the arm stops, whatever the controller chose for its loss. */
    void distrust(Controller client, String why) {
        lose(client, OnLost.STOP, why);
    }

    private void lose(Controller client, OnLost action, String why) {
        synchronized (this) {
            if (controller != client || leaving) {
                return;
            }
            leaving = true;
        }
        log.warn(client.name() + " lost control: " + why);
        try {
            if (action == OnLost.STOP) {
                executor.stopAll(Cause.LOST, client.name() + " was lost: " + why);
            }
            monitors.closeAll();
        } catch (RuntimeException e) {
            log.error("stopping the robot", e);
        } finally {
            free(client.name() + " was lost: " + why);
        }
    }

    /** Whether a client controls the robot. */
    synchronized boolean isHeld() {
        return controller != null && controller.session() != NO_SESSION;
    }

    synchronized boolean isController(Controller client) {
        return controller == client && !leaving;
    }

    /** Name of the controller; empty: none. */
    public synchronized String name() {
        return controller == null ? "" : controller.name();
    }

    /** Silence [s] after which the controller counts as lost. */
    synchronized double watchdog() {
        return watchdog;
    }
}
