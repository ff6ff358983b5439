package heptarm.core.motion;

import java.util.Arrays;

import heptarm.core.Clock;
import heptarm.core.EventBus;
import heptarm.core.Log;
import heptarm.core.robot.MotionJob;
import heptarm.core.state.StateReader;
import heptarm.wire.Cause;
import heptarm.wire.ConditionFired;
import heptarm.wire.Groups;
import heptarm.wire.JointState;
import heptarm.wire.Message;
import heptarm.wire.MotionFinished;
import heptarm.wire.State;
import heptarm.wire.TriggerFired;

/** Publishes the events of motions, with the robot's state at that moment. An event goes out even if a reading fails. */
public final class MotionReporter {
    private static final int JOINTS = 7;

    private final EventBus events;
    private final StateReader reader;
    private final Clock clock;
    private final Log log;

    public MotionReporter(EventBus events, StateReader reader, Clock clock, Log log) {
        this.events = events;
        this.reader = reader;
        this.clock = clock;
        this.log = log;
    }

    void publish(Message event) {
        events.publish(event);
    }

    void conditionFired(long id, int item, int node) {
        try {
            State now = reader.read(Groups.JOINTS | Groups.TORQUES | Groups.POSE | Groups.WRENCH);
            events.publish(new ConditionFired(id, item, node, now.joints, now.torques, now.pose, now.wrench));
        } catch (Throwable e) { // the end is reported in any case
            log.error("reading the robot when a condition of motion " + id + " fired", e);
        }
    }

    /** A trigger has fired; code and text say what became of its action. */
    void triggerFired(long id, int item, int trigger, String label, double time, int code, String text) {
        JointState joints = null;
        try {
            joints = reader.joints();
        } catch (Throwable e) {
            log.error("reading the joints when a trigger of motion " + id + " fired", e);
        }
        events.publish(new TriggerFired(id, item, trigger, label, time, joints, code, text));
    }

    /** A program has ended; {@code moved}: it had reached the robot. */
    void finished(Program program, boolean moved) {
        double[] q = new double[JOINTS];
        double residual = moved ? 0.0 : Double.NaN;
        try {
            JointState last = reader.joints();
            q = last.q;
            for (int i = 0; moved && i < JOINTS; i++) {
                residual = Math.max(residual, Math.abs(q[i] - last.q_cmd[i]));
            }
        } catch (Throwable e) {
            log.error("reading the joints at the end of motion " + program.id, e);
            Arrays.fill(q, Double.NaN);
            residual = Double.NaN;
        }
        Cause cause;
        String text;
        synchronized (program) {
            cause = program.cause;
            if (cause == null) {
                MotionJob.Outcome last = program.outcomes[program.outcomes.length - 1];
                cause = last == MotionJob.Outcome.DONE ? Cause.FINISHED
                        : last == MotionJob.Outcome.CONDITION ? Cause.CONDITION : Cause.STOPPED;
            }
            text = program.text.length() > 0 ? program.text : program.why;
        }
        double duration = program.began == 0 ? 0.0 : (clock.nanos() - program.began) * 1e-9;
        ContactLog contact = program.contact;
        boolean isTouch = cause == Cause.CONDITION || program.isReactionFailed();
        double peak = isTouch && contact != null ? contact.peak() : Double.NaN;
        double rest = isTouch && contact != null ? contact.rest() : Double.NaN;
        events.publish(new MotionFinished(program.id, program.item, cause, isTouch ? program.fired : -1, residual, duration, q, peak, rest,
                program.code, text));
    }
}
