package heptarm.core.motion;

import heptarm.core.Clock;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.core.checks.Conditions;
import heptarm.core.robot.Sensors;
import heptarm.core.robot.SignalPort;
import heptarm.core.state.ConditionReadings;
import heptarm.wire.Cause;
import heptarm.wire.Condition;

/**
 * Monitors break conditions that the robot does not monitor itself: in servo motions and hand guiding, and on number signals.
 *
 * <p>It evaluates them 250 times a second, or as often as the robot's getters allow; each takes a cabinet about 2 ms.
 */
public final class ConditionWatcher {
    private static final long PERIOD_NS = 4000000L;
    /** After so many failed readings in a row the motion is stopped. */
    private static final int MAX_FAILURES = 25;

    private final Sensors sensors;
    private final SignalPort signals;
    private final Clock clock;
    private final Log log;

    public ConditionWatcher(Sensors sensors, SignalPort signals, Clock clock, Log log) {
        this.sensors = sensors;
        this.signals = signals;
        this.clock = clock;
        this.log = log;
    }

    /** A watch for one item of a program; it is idle until it is started. */
    Watch watch(Program program, int item, Condition condition) {
        return new Watch(program, item, Conditions.alternatives(condition));
    }

    /** Monitors the condition of one item in a thread of its own. */
    final class Watch {
        private final Program program;
        private final int item;
        private final Conditions.Tree[] trees;
        private Thread thread;
        private volatile boolean closed;

        private Watch(Program program, int item, Conditions.Tree[] trees) {
            this.program = program;
            this.item = item;
            this.trees = trees;
        }

        /** Start monitoring; only the first call has an effect. */
        synchronized void start() {
            if (thread != null || trees.length == 0) {
                return;
            }
            thread = Threads.start("ha-guard", new Runnable() {
                public void run() {
                    work();
                }
            });
        }

        synchronized void close() {
            closed = true;
            if (thread != null) {
                thread.interrupt();
            }
        }

        private void work() {
            long next = clock.nanos();
            int failures = 0;
            try {
                while (!closed && program.cause() == null) {
                    next = Math.max(next + PERIOD_NS, clock.nanos());
                    clock.hold(clock.sleepUntil(next));
                    try {
                        Conditions.Tree fired = new ConditionReadings(sensors, signals, clock.stamp()).first(trees);
                        failures = 0;
                        if (fired != null && !closed) {
                            program.fired(item, fired.index);
                            program.end(Cause.CONDITION, "");
                            return;
                        }
                    } catch (Throwable e) { // also a method that this cabinet lacks: without its condition the motion must not go on
                        if (++failures == MAX_FAILURES) {
                            log.error("evaluating a break condition", e);
                            program.end(Cause.STOPPED, "its break condition cannot be evaluated: " + e.getMessage());
                            return;
                        }
                    }
                }
            } catch (InterruptedException e) {
                Thread.currentThread().interrupt();
            }
        }
    }
}
