package heptarm.core;

import heptarm.wire.Code;
import heptarm.wire.FriChanged;
import heptarm.wire.FriCommandMode;
import heptarm.wire.FriOpen;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;

/** One FRI session, from its opening to its end; with an overlay it is a program's activity, without one it only monitors. */
final class FriRun implements Activity, Fri.Listener {
    final FriOpen open;
    private final Server server;
    private long deadline;
    private long id;
    private Fri fri;
    private FriSessionState state = FriSessionState.IDLE;
    private FriQuality quality = FriQuality.POOR;
    private boolean stood;
    private boolean closed;

    FriRun(Server server, FriOpen open) {
        this.server = server;
        this.open = open;
        this.deadline = patience();
    }

    /** Until when its client may stay away; the client's seconds, not a simulator's. */
    private long patience() {
        return System.nanoTime() + (long) (open.timeout * 1e9);
    }

    boolean onlyMonitors() {
        return open.command == FriCommandMode.MONITOR;
    }

    public void number(long accepted) {
        id = accepted;
    }

    public heptarm.wire.Mode mode() {
        return open.mode;
    }

    /** Opens the session. */
    void start() throws Refusal {
        Fri opened = server.robot.fri(open, this);
        boolean late;
        synchronized (this) {
            fri = opened;
            late = closed;
        }
        if (late) {
            opened.close();
        }
    }

    public void perform(Program program) throws InterruptedException {
        try {
            start();
            if (awaitReady()) {
                program.adopt(fri.command(program.listener(0)));
            } else if (program.cause() == null) {
                program.fail(0, Code.NOT_READY, silence());
            } else {
                program.skip(0);
            }
        } catch (Refusal e) {
            program.fail(0, e.code, e.getMessage());
        }
        program.await(0);
        finish(program.code, program.text);
    }

    private synchronized String silence() {
        if (stood) {
            return "the FRI client at " + open.host + ":" + open.port + " has not answered well for " + open.timeout
                    + " s: the session fell to " + state + ", its quality is " + quality;
        }
        return "no FRI client answered from " + open.host + ":" + open.port + " within " + open.timeout
                + " s, or not well enough: the session is in " + state + ", its quality " + quality
                + "; check address, port and firewall, and that both sides have the same FRI version";
    }

    private synchronized boolean awaitReady() throws InterruptedException {
        while (!closed && state != FriSessionState.MONITORING_READY) {
            long left = deadline - System.nanoTime();
            if (left <= 0) {
                return false;
            }
            java.util.concurrent.TimeUnit.NANOSECONDS.timedWait(this, left);
        }
        return !closed;
    }

    /** Ends a session that only monitors when nobody answers it in time; false when it has ended. */
    boolean look() {
        synchronized (this) {
            if (closed) {
                return false;
            }
            if (state != FriSessionState.MONITORING_WAIT || System.nanoTime() < deadline) {
                return true;
            }
        }
        finish(Code.NOT_READY, silence());
        return false;
    }

    /** Closes the session and tells that it is over. */
    void finish(int code, String text) {
        Fri opened;
        synchronized (this) {
            opened = fri;
            fri = null;
            closed = true;
            notifyAll();
        }
        if (opened != null) {
            try {
                opened.close();
            } catch (RuntimeException e) {
                server.log.error("closing FRI session " + id, e);
            }
        }
        server.broadcast(new FriChanged(id, FriSessionState.IDLE, quality, code, text));
    }

    public synchronized void close() {
        closed = true;
        notifyAll();
    }

    public void begun() {
    }

    public void over(Job.Ended how) {
    }

    public void changed(FriSessionState newState, FriQuality newQuality) {
        synchronized (this) {
            // IDLE is told by `finish`; one from before the session began may come late
            if (closed || newState == FriSessionState.IDLE || newState == state && newQuality == quality) {
                return;
            }
            if (stood && newState != state && newState == FriSessionState.MONITORING_WAIT) {
                deadline = patience();
            }
            stood |= newState == FriSessionState.MONITORING_READY;
            state = newState;
            quality = newQuality;
            server.broadcast(new FriChanged(id, newState, newQuality, 0, "")); // before anybody acts on it: in order
            notifyAll();
        }
    }
}
