package heptarm.core.safety;

import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

import heptarm.core.Clock;
import heptarm.core.CommandRejected;
import heptarm.core.EventBus;
import heptarm.core.robot.SafetyPort;
import heptarm.wire.Code;
import heptarm.wire.SafetyBits;
import heptarm.wire.SafetyChanged;
import heptarm.wire.SafetyState;

/**
 * Monitors the robot's safety state: reports what a stop interrupts, refuses motions that cannot begin, and names the steps that
 * an operator has to take.
 *
 * <p>After a stop the robot itself only pauses, and would resume on Start. A program on a remote computer must not: its intent
 * may have changed. So a stop ends the motion. Only a released enabling switch pauses motions, since the person who holds it
 * supervises them; a motion that follows external targets ends in that case, too.
 */
public final class SafetyMonitor implements Watchdog.Check {
    /** What does not matter to people. */
    private static final int QUIET = SafetyBits.MOVING | SafetyBits.BRAKES_OPEN;
    /** How long acknowledging and resuming may take; short, since the client's other messages wait meanwhile. */
    private static final long TIMEOUT_NS = 100000000L;
    private static final long PAUSE_MS = 5;

    private final SafetyPort port;
    private final EventBus events;
    private final Clock clock;
    private final List<Listener> listeners = new CopyOnWriteArrayList<Listener>();
    private SafetyAssessment seen;
    private boolean holding;

    /** Ends motions for safety reasons. */
    public interface Listener {
        /** No motion may begin; a program that has not moved yet must end. */
        void blocked(String steps);

        /** A stop is active; every motion must end. */
        void stopped(String reason);

        /** The enabling switch is not pressed; motions that follow external targets must end. */
        void notEnabled(String reason);
    }

    public SafetyMonitor(SafetyPort port, EventBus events, Clock clock) {
        this.port = port;
        this.events = events;
        this.clock = clock;
    }

    public void add(Listener listener) {
        listeners.add(listener);
    }

    public boolean isIdle() {
        return false;
    }

    /** Checks the robot's safety state; called periodically. */
    public void check() {
        SafetyAssessment now = update();
        for (Listener listener : listeners) {
            if (now.isHolding()) { // a program may have been accepted before that was seen
                listener.blocked(now.steps());
            }
            if (now.isStop()) {
                listener.stopped(now.reason());
            } else if (now.lacksEnabling()) {
                listener.notEnabled(now.reason());
            }
        }
    }

    /** The current safety state. Any thread. */
    public SafetyState read() {
        clock.hold(clock.nanos());
        try {
            return port.read(clock.stamp());
        } finally {
            clock.release();
        }
    }

    private SafetyAssessment update() {
        SafetyAssessment now = new SafetyAssessment(read());
        SafetyAssessment before;
        synchronized (this) {
            before = seen;
            seen = now;
            if (now.isHolding()) {
                holding = true;
            } else if (now.isReady()) {
                holding = false;
            }
        }
        if (before != null && now.differsFrom(before, QUIET)) {
            events.publish(new SafetyChanged(now.state.bits, now.state.mode, now.summary()));
        }
        return now;
    }

    /** Whether a stop is active, or was active and the robot has not been released since. */
    public synchronized boolean isHolding() {
        return holding;
    }

    /** Whether a safety function has stopped the robot, by its present state: a motion may fail before a periodic check. */
    public boolean isStopped() {
        try {
            return update().isStop();
        } catch (Throwable e) { // a motion that fails must end, also if the state cannot be read
            synchronized (this) {
                return seen != null && seen.isStop();
            }
        }
    }

    /** Refuses a motion that could not begin. */
    public void checkReady() throws CommandRejected {
        if (!isHolding()) {
            return;
        }
        SafetyAssessment now = update(); // the stop may just have been cleared
        String steps = now.steps();
        if (steps.length() > 0) {
            throw new CommandRejected(Code.NEEDS_OPERATOR, steps);
        }
        if (isHolding()) {
            throw new CommandRejected(Code.SAFETY_STOP, "the robot is still paused after a stop; call recover, or press Start");
        }
    }

    /** Does what software may do; refuses with the operator's steps if that is not enough. */
    public void recover() throws CommandRejected {
        SafetyAssessment now = update();
        if (!now.isAcknowledgeable()) {
            throw new CommandRejected(Code.NEEDS_OPERATOR, now.steps());
        }
        port.recover();
        long deadline = System.nanoTime() + TIMEOUT_NS;
        try {
            now = update();
            while (!now.isReady() && System.nanoTime() < deadline) {
                Thread.sleep(PAUSE_MS); // not by the clock: it would show a simulated robot as it was at the wake-up
                now = update();
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
        if (!now.isReady()) {
            String steps = now.steps();
            throw new CommandRejected(Code.NEEDS_OPERATOR,
                    steps.length() > 0 ? steps : "follow the instructions on the smartPAD, then press Start");
        }
    }
}
