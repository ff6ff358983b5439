package heptarm.core.motion;

import heptarm.core.Clock;
import heptarm.core.Clocks;
import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.FriSession;
import heptarm.core.robot.MotionJob;
import heptarm.core.robot.MotionPort;
import heptarm.wire.Code;
import heptarm.wire.FriChanged;
import heptarm.wire.FriOpen;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;
import heptarm.wire.Mode;

/** One FRI session, from open to close: an activity if its client commands the robot; otherwise it only monitors. */
final class FriActivity implements Activity, FriSession.Listener {
    private final FriOpen open;
    private final MotionPort port;
    private final MotionReporter reporter;
    private final Clock clock;
    private final Log log;
    private long deadline;
    private long id;
    private FriSession session;
    private FriSessionState state = FriSessionState.IDLE;
    private FriQuality quality = FriQuality.POOR;
    private boolean wasReady;
    private boolean closed;

    FriActivity(FriOpen open, MotionPort port, MotionReporter reporter, Clock clock, Log log) {
        this.open = open;
        this.port = port;
        this.reporter = reporter;
        this.clock = clock;
        this.log = log;
        this.deadline = newDeadline();
    }

    /** When the client must have answered. */
    private long newDeadline() {
        return Clocks.afterClientSeconds(clock, open.timeout);
    }

    public void number(long accepted) {
        id = accepted;
    }

    public Mode mode() {
        return open.mode;
    }

    /** Open the session. */
    void start() throws CommandRejected {
        FriSession opened = port.openFri(open, this);
        boolean late;
        synchronized (this) {
            session = opened;
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
                program.adopt(session.command(program.listener(0)));
            } else if (program.cause() == null) {
                program.fail(0, Code.NOT_READY, noAnswer());
            } else {
                program.skip(0);
            }
        } catch (CommandRejected e) {
            program.fail(0, e.code, e.getMessage());
        }
        program.await(0);
        finish(program.code, program.text);
    }

    private synchronized String noAnswer() {
        if (wasReady) {
            return "the FRI client at " + open.host + ":" + open.port + " has not answered well for " + open.timeout
                    + " s: the session fell back to " + state + " with quality " + quality;
        }
        return "no FRI client answered from " + open.host + ":" + open.port + " within " + open.timeout
                + " s, or not well enough: the session is in " + state + " with quality " + quality
                + "; check address, port and firewall, and that both sides have the same FRI version";
    }

    private synchronized boolean awaitReady() throws InterruptedException {
        while (!closed && state != FriSessionState.MONITORING_READY) {
            if (!Clocks.await(this, clock, deadline)) {
                return false;
            }
        }
        return !closed;
    }

    /** Closes a monitoring session whose client does not answer in time; false if the session is closed. */
    boolean checkClient() {
        synchronized (this) {
            if (closed) {
                return false;
            }
            if (state != FriSessionState.MONITORING_WAIT || clock.nanos() < deadline) {
                return true;
            }
        }
        finish(Code.NOT_READY, noAnswer());
        return false;
    }

    /** Close the session and report its end. */
    void finish(int code, String text) {
        FriSession opened;
        synchronized (this) {
            opened = session;
            session = null;
            closed = true;
            notifyAll();
        }
        if (opened != null) {
            try {
                opened.close();
            } catch (RuntimeException e) {
                log.error("closing FRI session " + id, e);
            }
        }
        reporter.publish(new FriChanged(id, FriSessionState.IDLE, quality, code, text));
    }

    public synchronized void close() {
        closed = true;
        notifyAll();
    }

    public void started() {
    }

    public void ended(MotionJob.Outcome outcome) {
    }

    public void changed(FriSessionState newState, FriQuality newQuality) {
        synchronized (this) {
            // `finish` reports IDLE; one from before the session began may arrive late
            if (closed || newState == FriSessionState.IDLE || newState == state && newQuality == quality) {
                return;
            }
            if (wasReady && newState != state && newState == FriSessionState.MONITORING_WAIT) {
                deadline = newDeadline();
            }
            wasReady |= newState == FriSessionState.MONITORING_READY;
            state = newState;
            quality = newQuality;
            reporter.publish(new FriChanged(id, newState, newQuality, 0, "")); // before a waiting thread acts: keeps the order
            notifyAll();
        }
    }
}
