package heptarm.core;

import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.List;

import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.HandGuide;
import heptarm.wire.Mode;
import heptarm.wire.MotionFinished;
import heptarm.wire.MotionStarted;
import heptarm.wire.PositionMode;
import heptarm.wire.Run;
import heptarm.wire.StopKind;
import heptarm.wire.When;

/** Carries out programs one after the other, each as one batch of jobs, and tells everybody what becomes of them. */
final class Executor {
    private static final int MAX_QUEUED = 1000;
    private static final int MAX_ITEMS = 20000;

    private final Server server;
    private final ArrayDeque<Program> queue = new ArrayDeque<Program>();
    private Program running;
    private long lastId;
    private boolean closed;
    private Thread thread;

    Executor(Server server) {
        this.server = server;
    }

    void start() {
        thread = new Thread(new Runnable() {
            public void run() {
                work();
            }
        }, "ha-motion");
        thread.setDaemon(true);
        thread.start();
    }

    // ------------------------------------------------------------------------------- requests, from readers

    long add(Run run) throws Refusal {
        List<Program> replaced = new ArrayList<Program>();
        Program program;
        synchronized (this) {
            if (closed) {
                throw new Refusal(Code.SHUTTING_DOWN, "the cabinet application ends");
            }
            boolean busy = running != null || !queue.isEmpty();
            if (run.when == When.REJECT && busy) {
                throw new Refusal(Code.BUSY, "when", "reject", "", "motion " + (running != null ? running.id : queue.peek().id)
                        + " is running; wait for it, or use when=\"queue\" or when=\"replace\"");
            }
            if (queue.size() >= MAX_QUEUED) {
                throw new Refusal(Code.QUEUE_FULL, MAX_QUEUED + " programs are waiting already");
            }
            int items = run.items.length;
            for (Program waiting : queue) {
                items += waiting.size();
            }
            if (items > MAX_ITEMS && run.when != When.REPLACE) {
                throw new Refusal(Code.QUEUE_FULL, "items", Integer.toString(run.items.length), "",
                        "at most " + MAX_ITEMS + " motions may wait; with these there would be " + items);
            }
            if (run.when == When.REPLACE) {
                replaced.addAll(queue);
                queue.clear();
                if (running != null) {
                    replaced.add(0, running);
                }
            }
            program = queue(run, null);
        }
        end(replaced, Cause.REPLACED, "motion " + program.id + " took its place");
        return program.id;
    }

    /** The next number of a motion or a session. */
    synchronized long number() {
        lastId = lastId % 0xFFFFFFFFL + 1;
        return lastId;
    }

    private Program queue(Run run, Activity activity) {
        Program program = new Program(server, number(), run, activity);
        queue.add(program);
        notifyAll();
        return program;
    }

    /** Begins an activity; nothing else may be under way, since it starts where the arm is now. */
    synchronized long open(Activity activity) throws Refusal {
        if (closed) {
            throw new Refusal(Code.SHUTTING_DOWN, "the cabinet application ends");
        }
        if (running != null || !queue.isEmpty()) {
            throw new Refusal(Code.BUSY, "motion " + (running != null ? running.id : queue.peek().id)
                    + " is running; wait for it or stop it before the robot is led from outside");
        }
        Program program = queue(null, activity);
        activity.number(program.id);
        return program.id;
    }

    /** Something that must not happen while the arm moves. */
    interface Change {
        void make() throws Refusal;
    }

    /** Makes a change while nothing runs or waits, and keeps anything from beginning meanwhile. */
    synchronized void whileIdle(Change change) throws Refusal {
        if (running != null || !queue.isEmpty()) {
            throw new Refusal(Code.BUSY, "motion " + (running != null ? running.id : queue.peek().id)
                    + " is running; wait for it or stop it before the load changes");
        }
        change.make();
    }

    /** Control mode of what runs; position control while nothing does. */
    synchronized Mode mode() {
        Mode mode = null;
        if (running != null && running.activity != null) {
            mode = running.activity.mode();
        } else if (running != null) {
            mode = running.run.items[running.item].mode;
        }
        return mode == null ? new PositionMode() : mode;
    }

    /** The activity that runs or is about to under a number; null if there is none. */
    synchronized Activity activity(long id) {
        Program program = running != null ? running : queue.peek();
        return program != null && program.id == id ? program.activity : null;
    }

    void cancel(long id) throws Refusal {
        List<Program> chosen = take(id);
        if (id != 0 && chosen.isEmpty()) {
            throw new Refusal(Code.UNKNOWN_MOTION, "id", Long.toString(id), "", "motion " + id + " is neither running nor waiting");
        }
        end(chosen, Cause.CANCELLED, "");
    }

    void stop(StopKind kind) {
        if (kind == StopKind.AFTER_MOTION) {
            List<Program> waiting;
            synchronized (this) {
                waiting = new ArrayList<Program>(queue);
                queue.clear();
            }
            end(waiting, Cause.STOPPED, "a stop was commanded");
            return;
        }
        endAll(Cause.STOPPED, "a stop was commanded");
        if (kind == StopKind.FAST) {
            server.robot.stopFast();
        } else {
            server.robot.stop();
        }
    }

    void endAll(Cause cause, String why) {
        endAll(cause, 0, why);
    }

    void endAll(Cause cause, int code, String why) {
        end(take(0), cause, code, why);
    }

    /** Ends what was accepted but has not begun to move; what waits behind it is dropped. */
    void endUnmoved(int code, String why) {
        Program program;
        synchronized (this) {
            program = running != null ? running : queue.peek();
        }
        if (program != null && !program.moved) {
            program.end(Cause.FAILED, code, why);
        }
    }

    /** Ends what runs if it is led from outside. */
    void endActivity(Cause cause, int code, String why) {
        Program program;
        synchronized (this) {
            program = running;
        }
        if (program != null && program.activity != null) {
            program.end(cause, code, why);
        }
    }

    private synchronized List<Program> take(long id) {
        List<Program> chosen = new ArrayList<Program>();
        if (running != null && (id == 0 || running.id == id)) {
            chosen.add(running);
        }
        for (Program program : new ArrayList<Program>(queue)) {
            if (id == 0 || program.id == id) {
                queue.remove(program);
                chosen.add(program);
            }
        }
        return chosen;
    }

    private void end(List<Program> programs, Cause cause, String why) {
        end(programs, cause, 0, why);
    }

    private void end(List<Program> programs, Cause cause, int code, String why) {
        for (Program program : programs) {
            program.end(cause, code, why);
            boolean waiting;
            synchronized (this) {
                waiting = program != running;
            }
            if (waiting && program.began == 0) {
                tell(program, false);
            }
        }
    }

    /** Id of what runs (0: nothing), its item, and the number of programs that wait. */
    synchronized long[] status() {
        return new long[] {running == null ? 0 : running.id, running == null ? 0 : running.item, queue.size()};
    }

    void close() {
        synchronized (this) {
            closed = true;
            notifyAll();
        }
        endAll(Cause.STOPPED, "the cabinet application ends");
        Threads.join(thread);
    }

    // ------------------------------------------------------------------------------- the motion thread

    private void work() {
        try {
            while (true) {
                Program program;
                synchronized (this) {
                    while (queue.isEmpty() && !closed) {
                        wait();
                    }
                    if (closed) {
                        return;
                    }
                    program = queue.poll();
                    program.began = server.clock.nanos();
                    running = program;
                }
                try {
                    carryOut(program);
                } catch (InterruptedException e) {
                    throw e;
                } catch (Throwable e) { // also a class that this cabinet lacks: the next program will want this thread
                    server.log.error("motion " + program.id, e);
                    synchronized (program) {
                        program.cause = Cause.FAILED;
                        program.code = Code.INTERNAL;
                        program.text = String.valueOf(e);
                    }
                    program.end(Cause.FAILED, "");
                }
                List<Program> behind = new ArrayList<Program>();
                synchronized (this) {
                    running = null;
                    if (program.cause == Cause.FAILED) { // the robot is not where what waits would begin
                        behind.addAll(queue);
                        queue.clear();
                    }
                }
                tell(program, true);
                end(behind, Cause.DROPPED, "motion " + program.id + " before it failed");
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private void carryOut(Program program) throws InterruptedException {
        if (program.activity != null) {
            program.activity.perform(program);
            return;
        }
        for (int i = 0; i < program.run.items.length; i++) {
            if (program.cause() != null) {
                program.skip(i);
                continue;
            }
            int together = Batches.length(program.run.items, i);
            if (together > 1) {
                Batches.start(server, program, i, together);
                i += together - 1;
                if (program.run.items[i].until.nodes.length > 0) {
                    watch(program, i);
                }
                continue;
            }
            try {
                Job job = server.robot.start(program.run.items[i],
                        program.run.items[i].mode == null ? new PositionMode() : program.run.items[i].mode, program.listener(i));
                program.adopt(job);
            } catch (Refusal e) {
                program.listener(i).finished(Job.Ended.FAILED, e.code, e.getMessage());
            }
            if (program.run.items[i].until.nodes.length > 0) { // nothing begins behind a motion that a condition may end
                watch(program, i);
            }
        }
        for (int i = 0; i < program.ended.length; i++) {
            program.await(i);
            if (program.cause() != null) {
                program.end(program.cause, program.why);
            }
        }
    }

    /** Waits for the end of a motion with a break condition; watches the condition if the robot does not. */
    private void watch(Program program, int item) throws InterruptedException {
        Condition until = program.run.items[item].until;
        // the robot's API does not say that hand guiding has break conditions
        if (!(program.run.items[item].motion instanceof HandGuide) && server.robot.watches(until)) {
            program.await(item);
            return;
        }
        Guard guard = new Guard(server, program, item, until);
        guard.start();
        try {
            program.await(item);
        } finally {
            guard.close();
        }
    }

    private void tell(Program program, boolean moved) {
        double[] q = new double[7];
        double[] commanded = new double[7];
        double residual = moved ? 0.0 : Double.NaN;
        try {
            server.robot.readJoints(q, commanded);
            for (int i = 0; moved && i < 7; i++) {
                residual = Math.max(residual, Math.abs(q[i] - commanded[i]));
            }
        } catch (RuntimeException e) { // the end is told in any case
            server.log.error("reading the joints at the end of motion " + program.id, e);
            java.util.Arrays.fill(q, Double.NaN);
            residual = Double.NaN;
        }
        Cause cause;
        String text;
        synchronized (program) {
            cause = program.cause;
            if (cause == null) {
                Job.Ended last = program.ended[program.ended.length - 1];
                cause = last == Job.Ended.DONE ? Cause.FINISHED : last == Job.Ended.CONDITION ? Cause.CONDITION : Cause.STOPPED;
            }
            text = program.text.length() > 0 ? program.text : program.why;
        }
        double duration = program.began == 0 ? 0.0 : (server.clock.nanos() - program.began) * 1e-9;
        int fired = cause == Cause.CONDITION ? program.fired : -1;
        server.broadcast(new MotionFinished(program.id, program.item, cause, fired, residual, duration, q, program.code, text));
    }
}
