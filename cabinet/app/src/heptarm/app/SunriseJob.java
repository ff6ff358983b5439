package heptarm.app;

import java.util.ArrayList;
import java.util.List;

import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

import heptarm.core.Job;
import heptarm.wire.Code;

/** A motion container of Sunrise as a job of the core. It ends once, whoever hears of it first. */
class SunriseJob implements Job, IMotionContainerListener {
    private final Job.Listener listener;
    /** Segments of a spline, told of one by one where the cabinet does. */
    final List<IMotion> segments = new ArrayList<IMotion>();
    private BreakConditions until;
    private IMotionContainer container;
    private boolean cancelled;
    private boolean ended;

    SunriseJob(Job.Listener listener) {
        this.listener = listener;
    }

    /** A motion that conditions may end. */
    void guard(RobotMotion<?> motion, BreakConditions conditions) {
        until = conditions;
        conditions.watch(motion, listener);
    }

    /** The container, once moveAsync has returned it. */
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
        String why = text == null ? "the cabinet gives no reason" : text;
        end(Ended.FAILED, code(why), why);
    }

    private void end(Ended how, int code, String text) {
        synchronized (this) {
            if (ended) {
                return;
            }
            ended = true;
        }
        listener.finished(how, code, text);
    }

    /** The cabinet speaks in texts only. */
    static int code(String text) {
        if (text.indexOf("safety stop") >= 0) {
            return Code.SAFETY_STOP;
        }
        if (text.indexOf("singularity") >= 0) {
            return text.indexOf("Can not plan") >= 0 ? Code.PLANNING_FAILED : Code.EXECUTION_FAILED;
        }
        if (text.indexOf("violates limit") >= 0) {
            return Code.JOINT_LIMIT;
        }
        if (text.indexOf("not reachable") >= 0) {
            return Code.UNREACHABLE;
        }
        return text.indexOf("Can not plan") >= 0 ? Code.PLANNING_FAILED : Code.EXECUTION_FAILED;
    }

    public void onStateChanged(IExecutionContainer changed, ExecutionState state) {
    }

    public void containerFinished(IMotionContainer finished) {
        if (finished.hasError()) {
            fail(finished.getErrorMessage());
            return;
        }
        boolean wanted;
        synchronized (this) {
            wanted = cancelled;
        }
        if (finished.getFiredBreakConditionInfo() != null) {
            if (until != null) {
                until.tell(finished, listener);
            }
            end(Ended.CONDITION, 0, "");
        } else {
            end(wanted ? Ended.CANCELLED : Ended.DONE, 0, "");
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
