package heptarm.app;

import java.util.ArrayList;
import java.util.List;

import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

import heptarm.core.robot.FailureTexts;
import heptarm.core.robot.MotionJob;

/** A motion container of Sunrise as a job of the core. It ends once, whichever callback comes first. */
class SunriseJob implements MotionJob, IMotionContainerListener {
    private final MotionJob.Listener listener;
    /** Segments of a spline, which some cabinets report one by one. */
    final List<IMotion> segments = new ArrayList<IMotion>();
    private BreakConditions until;
    private IMotionContainer container;
    private boolean cancelled;
    private boolean ended;

    SunriseJob(MotionJob.Listener listener) {
        this.listener = listener;
    }

    /** Let conditions end a motion. */
    void breakWhen(RobotMotion<?> motion, BreakConditions conditions) {
        until = conditions;
        conditions.addTo(motion, listener);
    }

    /** Set the container that moveAsync has returned. */
    void set(IMotionContainer accepted) {
        boolean late;
        synchronized (this) {
            container = accepted;
            late = cancelled;
        }
        if (late) {
            accepted.cancel();
        }
    }

    public void cancel() {
        IMotionContainer accepted;
        synchronized (this) {
            cancelled = true;
            accepted = ended ? null : container;
        }
        if (accepted != null) {
            accepted.cancel();
        }
    }

    void fail(String text) {
        String why = text == null ? "the cabinet reports no reason" : text;
        end(Outcome.FAILED, FailureTexts.code(why), why);
    }

    private void end(Outcome outcome, int code, String text) {
        synchronized (this) {
            if (ended) {
                return;
            }
            ended = true;
        }
        listener.finished(outcome, code, text);
    }

    public void onStateChanged(IExecutionContainer changed, ExecutionState state) {
    }

    public void containerFinished(IMotionContainer finished) {
        if (finished.hasError()) {
            fail(finished.getErrorMessage());
            return;
        }
        boolean wasCancelled;
        synchronized (this) {
            wasCancelled = cancelled;
        }
        if (finished.getFiredBreakConditionInfo() != null) {
            if (until != null) {
                until.report(finished, listener);
            }
            end(Outcome.CONDITION, 0, "");
        } else {
            end(wasCancelled ? Outcome.CANCELLED : Outcome.DONE, 0, "");
        }
    }

    public void motionFinished(IMotion motion) {
    }

    public void motionStarted(IMotion motion) {
        for (int i = 0; i < segments.size(); i++) {
            if (segments.get(i) == motion) {
                listener.reached(i);
                return;
            }
        }
        listener.started();
    }
}
