package heptarm.core;

import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.List;

import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.ItemReached;
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

    /** A program and what becomes of it. Guarded by itself. */
    private final class Program {
        final long id;
        final Run run;
        final Stream stream;
        final List<Job> jobs = new ArrayList<Job>();
        final Job.Ended[] ended;
        int item;
        Cause cause;
        String why = "";
        int code;
        String text = "";
        long began;

        /** Either a run of motions or a stream of targets. */
        Program(long id, Run run, Stream stream) {
            this.id = id;
            this.run = run;
            this.stream = stream;
            this.ended = new Job.Ended[size()];
        }

        int size() {
            return run == null ? 1 : run.items.length;
        }

        /** Ends it for a cause; the first cause counts. */
        void end(Cause newCause, String newWhy) {
            List<Job> all;
            synchronized (this) {
                if (cause == null) {
                    cause = newCause;
                    why = newWhy;
                }
                all = new ArrayList<Job>(jobs);
                notifyAll();
            }
            if (stream != null) {
                stream.close();
            }
            for (int i = all.size() - 1; i >= 0; i--) {
                try {
                    all.get(i).cancel(); // from the last, so that none of them begins while the others are cancelled
                } catch (RuntimeException e) {
                    server.log.error("cancelling item " + i + " of motion " + id, e);
                }
            }
        }

        /** Notes a job; true if the program has ended already. */
        synchronized boolean adopt(Job job) {
            jobs.add(job);
            return cause != null;
        }

        synchronized Cause cause() {
            return cause;
        }

        /** Waits for the end of an item. */
        synchronized Job.Ended await(int index) throws InterruptedException {
            while (ended[index] == null) {
                wait();
            }
            return ended[index];
        }

        Job.Listener listener(final int index) {
            return new Job.Listener() {
                public void started() {
                    synchronized (Program.this) {
                        item = index;
                    }
                    server.broadcast(new MotionStarted(id, index));
                    if (stream != null) {
                        stream.begun();
                    }
                }

                public void finished(Job.Ended how, int failureCode, String failure) {
                    synchronized (Program.this) {
                        ended[index] = how;
                        if (how == Job.Ended.FAILED && cause == null) {
                            cause = Cause.FAILED;
                            code = failureCode;
                            text = failure;
                        }
                        Program.this.notifyAll();
                    }
                    if (stream != null) {
                        stream.over(how);
                    }
                }
            };
        }
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

    private Program queue(Run run, Stream stream) {
        lastId = lastId % 0xFFFFFFFFL + 1;
        Program program = new Program(lastId, run, stream);
        queue.add(program);
        notifyAll();
        return program;
    }

    /** Begins a servo motion; nothing else may be under way, since it starts where the arm is now. */
    synchronized long open(Stream stream) throws Refusal {
        if (closed) {
            throw new Refusal(Code.SHUTTING_DOWN, "the cabinet application ends");
        }
        if (running != null || !queue.isEmpty()) {
            throw new Refusal(Code.BUSY, "motion " + (running != null ? running.id : queue.peek().id)
                    + " is running; wait for it or stop it before a servo motion begins");
        }
        Program program = queue(null, stream);
        stream.number(program.id);
        return program.id;
    }

    /** The stream of a servo motion that runs or is about to; null if it is none, or has ended. */
    synchronized Stream stream(long id) {
        Program program = running != null ? running : queue.peek();
        return program != null && program.id == id ? program.stream : null;
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
        server.robot.stop();
    }

    void endAll(Cause cause, String why) {
        end(take(0), cause, why);
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
        for (Program program : programs) {
            program.end(cause, why);
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

    /** Lets a servo motion follow its targets; one that ended because none came for long is begun anew with the next. */
    private void serve(Program program) throws InterruptedException {
        Stream stream = program.stream;
        String starved = "";
        boolean goesOn = true;
        while (goesOn) {
            stream.prepare();
            synchronized (program) {
                program.ended[0] = null;
            }
            try {
                Servo servo = server.robot.servo(stream.open, program.listener(0));
                stream.adopt(servo);
                if (program.adopt(servo)) {
                    servo.cancel();
                }
                if (stream.awaitStart()) {
                    starved = stream.follow();
                }
            } catch (Refusal e) {
                program.listener(0).finished(Job.Ended.FAILED, e.code, e.getMessage());
            }
            if (starved.length() > 0) {
                program.end(Cause.STARVED, starved);
            }
            goesOn = program.await(0) == Job.Ended.DONE && program.cause() == null;
            if (goesOn && !stream.awaitNext()) {
                program.end(Cause.STARVED, "no target came for so long that the servo motion ended");
                goesOn = false;
            }
        }
        stream.tell();
    }

    private void carryOut(Program program) throws InterruptedException {
        if (program.stream != null) {
            serve(program);
            return;
        }
        for (int i = 0; i < program.run.items.length; i++) {
            synchronized (program) {
                if (program.cause != null) {
                    program.ended[i] = Job.Ended.CANCELLED;
                    continue;
                }
            }
            try {
                Job job = server.robot.start(program.run.items[i],
                        program.run.items[i].mode == null ? new PositionMode() : program.run.items[i].mode, program.listener(i));
                if (program.adopt(job)) {
                    job.cancel();
                }
            } catch (Refusal e) {
                program.listener(i).finished(Job.Ended.FAILED, e.code, e.getMessage());
            }
        }
        for (int i = 0; i < program.ended.length; i++) {
            if (program.await(i) == Job.Ended.DONE && i + 1 < program.ended.length) {
                server.broadcast(new ItemReached(program.id, i));
            }
            if (program.cause() != null) {
                program.end(program.cause, program.why);
            }
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
        server.broadcast(new MotionFinished(program.id, program.item, cause, -1, residual, duration, q, program.code, text));
    }
}
