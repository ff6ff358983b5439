package heptarm.core;

import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.OperationMode;
import heptarm.wire.SafetyBits;
import heptarm.wire.SafetyChanged;
import heptarm.wire.SafetyState;

/**
 * Knows what the robot's safety demands: ends what a stop has interrupted, refuses what cannot begin, tells what is left to do.
 *
 * <p>The robot itself only pauses when it is stopped, and would go on with Start. A program far away shall not: it may want
 * something else by now. So a stop ends what runs; only an enabling switch that is let go pauses motions, since the person
 * who holds it leads them. What follows targets from outside ends in that case, too.
 */
final class Warden {
    private static final int STOPS = SafetyBits.EMERGENCY_STOP | SafetyBits.OPERATOR_SAFETY_OPEN | SafetyBits.PROTECTIVE_STOP;
    /** What does not matter to people. */
    private static final int QUIET = SafetyBits.MOVING | SafetyBits.BRAKES_OPEN;
    /** How long acknowledging and resuming may take; short, since the client's other messages wait meanwhile. */
    private static final long PATIENCE_NS = 100000000L;
    private static final long PAUSE_MS = 5;

    private final Server server;
    private SafetyState seen;
    private boolean holding;

    Warden(Server server) {
        this.server = server;
    }

    /** Looks at the robot; called now and then by the watchdog. */
    void look() {
        SafetyState now = update();
        if (isStop(now) || lacksEnabling(now)) { // a program may have been accepted before that was seen
            server.executor.endUnmoved(Code.NEEDS_OPERATOR, steps(now));
        }
        if (isStop(now)) {
            server.executor.endAll(Cause.SAFETY, Code.SAFETY_STOP, reason(now));
        } else if (lacksEnabling(now)) {
            server.executor.endActivity(Cause.SAFETY, Code.SAFETY_STOP, reason(now));
        }
    }

    private SafetyState update() {
        SafetyState now = server.robot.readSafety(server.clock.nanos());
        SafetyState before;
        synchronized (this) {
            before = seen;
            seen = now;
            if (isStop(now) || lacksEnabling(now)) {
                holding = true;
            } else if (isReady(now)) {
                holding = false;
            }
        }
        if (before != null && (((now.bits ^ before.bits) & ~QUIET) != 0 || now.mode != before.mode)) {
            server.broadcast(new SafetyChanged(now.bits, now.mode, words(now)));
        }
        return now;
    }

    /** Whether a stop is in force, or was and nobody has let the robot go on. */
    synchronized boolean isHolding() {
        return holding;
    }

    /** Whether a safety function stops the robot, as far as was seen. */
    synchronized boolean isStopped() {
        return seen != null && isStop(seen);
    }

    /** Refuses a motion that could not begin. */
    void check() throws Refusal {
        if (!isHolding()) {
            return;
        }
        SafetyState now = update(); // it may just have been cleared
        String steps = steps(now);
        if (steps.length() > 0) {
            throw new Refusal(Code.NEEDS_OPERATOR, steps);
        }
        if (isHolding()) {
            throw new Refusal(Code.SAFETY_STOP, "a stop has held the robot and nothing lets it go on yet; recover, or press Start");
        }
    }

    /** Does what software may do; refuses with the operator's steps if that is not enough. */
    void recover() throws Refusal {
        SafetyState now = update();
        if (!isAcknowledgeable(now)) {
            throw new Refusal(Code.NEEDS_OPERATOR, steps(now));
        }
        server.robot.recover();
        long patience = System.nanoTime() + PATIENCE_NS;
        try {
            now = update();
            while (!isReady(now) && System.nanoTime() < patience) {
                Thread.sleep(PAUSE_MS); // not by the clock: a simulated robot would be seen as it was when this thread woke
                now = update();
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
        if (!isReady(now)) {
            String steps = steps(now);
            throw new Refusal(Code.NEEDS_OPERATOR, steps.length() > 0 ? steps : "do what the smartPAD shows, and press Start");
        }
    }

    // ------------------------------------------------------------------------------------------ what it means

    private static boolean has(SafetyState state, int bit) {
        return (state.bits & bit) != 0;
    }

    private static boolean lacksEnabling(SafetyState state) {
        return state.mode != OperationMode.AUT && !has(state, SafetyBits.ENABLING_SWITCH);
    }

    /** A stop that nobody leads; the one that goes with an enabling switch is none. */
    private static boolean isStop(SafetyState state) {
        int stops = lacksEnabling(state) ? STOPS & ~SafetyBits.PROTECTIVE_STOP : STOPS;
        return (state.bits & stops) != 0;
    }

    private static boolean isReady(SafetyState state) {
        return has(state, SafetyBits.READY_TO_MOVE) && !has(state, SafetyBits.PAUSED);
    }

    /** Whether there is no more than an error to acknowledge and a pause to end. */
    private static boolean isAcknowledgeable(SafetyState state) {
        return !has(state, SafetyBits.EMERGENCY_STOP) && !has(state, SafetyBits.OPERATOR_SAFETY_OPEN) && !lacksEnabling(state)
                && has(state, SafetyBits.MASTERED);
    }

    /** What a person has to do, one step after the other; empty: nothing. */
    private static String steps(SafetyState state) {
        StringBuilder steps = new StringBuilder();
        if (has(state, SafetyBits.EMERGENCY_STOP)) {
            step(steps, "release the emergency stop and acknowledge it at the smartPAD");
        }
        if (has(state, SafetyBits.OPERATOR_SAFETY_OPEN)) {
            step(steps, "close the safeguard and acknowledge it beside the cell");
        }
        if (lacksEnabling(state)) {
            step(steps, "hold the enabling switch of the smartPAD (the mode is " + state.mode + ")");
        } else if (has(state, SafetyBits.PROTECTIVE_STOP) && steps.length() == 0) {
            step(steps, "remove what the safety stop was for and acknowledge it at the smartPAD");
        }
        if (!has(state, SafetyBits.MASTERED)) {
            step(steps, "master the axes at the smartPAD");
        }
        return steps.toString();
    }

    private static void step(StringBuilder steps, String text) {
        steps.append(steps.length() > 0 ? "; " : "").append(text);
    }

    private static String reason(SafetyState state) {
        if (has(state, SafetyBits.EMERGENCY_STOP)) {
            return "the emergency stop was pressed";
        }
        if (has(state, SafetyBits.OPERATOR_SAFETY_OPEN)) {
            return "the safeguard was opened";
        }
        return lacksEnabling(state) ? "the enabling switch is not held (the mode is " + state.mode + ")"
                : "a safety function demanded a stop";
    }

    private static String words(SafetyState state) {
        if (isStop(state) || lacksEnabling(state)) {
            return reason(state);
        }
        if (isReady(state)) {
            return "the robot is ready to move";
        }
        return has(state, SafetyBits.PAUSED) ? "execution is paused" : "the robot is not ready to move";
    }
}
