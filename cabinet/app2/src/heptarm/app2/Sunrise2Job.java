package heptarm.app2;

import com.kuka.motion.IMotion;
import com.kuka.motion.IMotionContainer;
import com.kuka.motion.IMotionContainerListener;
import com.kuka.motion.MotionContainerState;

import heptarm.core.robot.FailureTexts;
import heptarm.core.robot.MotionJob;

/** A motion container of Sunrise 2.x as a job of the core. It ends once, whichever event comes first. */
class Sunrise2Job implements MotionJob, IMotionContainerListener {
    private final MotionJob.Listener listener;
    private IMotionContainer container;
    private boolean started;
    private boolean cancelled;
    private boolean ended;

    Sunrise2Job(MotionJob.Listener listener) {
        this.listener = listener;
    }

    /** Set the container that moveAsync has returned; looks at it once, since events before this are missed. */
    void set(IMotionContainer accepted) {
        boolean late;
        synchronized (this) {
            container = accepted;
            late = cancelled;
        }
        accepted.addContainerListener(this);
        if (late) {
            accepted.cancel();
        }
        if (accepted.getState().isFinal()) {
            containerFinished(accepted);
        } else {
            start();
        }
    }

    @Override
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

    private void start() {
        synchronized (this) {
            if (started || ended) {
                return;
            }
            started = true;
        }
        listener.started();
    }

    boolean isOver() {
        synchronized (this) {
            return ended;
        }
    }

    @Override
    public void onContainerStateChanged(IMotionContainer changed, MotionContainerState state) {
        if (state == MotionContainerState.ERROR) {
            fail(changed.getErrorMessage());
        }
    }

    @Override
    public void containerFinished(IMotionContainer finished) {
        if (finished.getState() == MotionContainerState.ERROR) {
            fail(finished.getErrorMessage());
            return;
        }
        boolean wasCancelled;
        synchronized (this) {
            wasCancelled = cancelled;
        }
        end(wasCancelled ? Outcome.CANCELLED : Outcome.DONE, 0, "");
    }

    @Override
    public void motionFinished(IMotionContainer of, IMotion motion) {
    }

    @Override
    public void motionStarted(IMotionContainer of, IMotion motion) {
        start();
    }
}
