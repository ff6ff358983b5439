package heptarm.core;

import heptarm.wire.Cause;
import heptarm.wire.Condition;

/**
 * Watches a break condition that the robot does not watch by itself: in servo motions, and on number signals.
 *
 * <p>It looks 250 times a second as far as the robot's getters let it; each of them takes a cabinet about 2 ms.
 */
final class Guard {
    private static final long PERIOD_NS = 4000000L;
    /** A robot that cannot be read for so long is not watched any more. */
    private static final int BLIND = 25;

    private final Server server;
    private final Program program;
    private final int item;
    private final Conditions.Tree[] trees;
    private Thread thread;
    private volatile boolean closed;

    Guard(Server server, Program program, int item, Condition condition) {
        this.server = server;
        this.program = program;
        this.item = item;
        this.trees = Conditions.alternatives(condition);
    }

    /** Begins to watch; once is enough. */
    synchronized void start() {
        if (thread != null || trees.length == 0) {
            return;
        }
        thread = new Thread(new Runnable() {
            public void run() {
                work();
            }
        }, "ha-guard");
        thread.setDaemon(true);
        thread.start();
    }

    synchronized void close() {
        closed = true;
        if (thread != null) {
            thread.interrupt();
        }
    }

    private void work() {
        long next = server.clock.nanos();
        int blind = 0;
        try {
            while (!closed && program.cause() == null) {
                next = Math.max(next + PERIOD_NS, server.clock.nanos());
                server.clock.sleepUntil(next);
                try {
                    Conditions.Tree fired = new Readings(server.robot, server.clock.nanos()).first(trees);
                    blind = 0;
                    if (fired != null && !closed) {
                        program.fired(item, fired.index);
                        program.end(Cause.CONDITION, "");
                        return;
                    }
                } catch (RuntimeException e) {
                    if (++blind == BLIND) {
                        server.log.error("watching a break condition", e);
                        program.end(Cause.STOPPED, "its break condition cannot be watched: " + e.getMessage());
                        return;
                    }
                }
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }
}
