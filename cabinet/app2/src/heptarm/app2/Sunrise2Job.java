package heptarm.app2;

import com.kuka.motion.IMotion;
import com.kuka.motion.IMotionContainer;
import com.kuka.motion.IMotionContainerListener;
import com.kuka.motion.MotionContainerState;

import heptarm.core.robot.ContainerJob;
import heptarm.core.robot.MotionJob;

/** A motion container of Sunrise 2.x as a job of the core. */
class Sunrise2Job extends ContainerJob implements IMotionContainerListener {
    private IMotionContainer container;
    private boolean started;

    Sunrise2Job(MotionJob.Listener listener) {
        super(listener);
    }

    /** Set the container that moveAsync has returned; looks at it once, since events before this are missed. */
    void set(IMotionContainer moved) {
        container = moved;
        moved.addContainerListener(this);
        accepted();
        if (moved.getState().isFinal()) {
            containerFinished(moved);
        } else {
            start();
        }
    }

    @Override
    protected void cancelContainer() {
        container.cancel();
    }

    private void start() {
        synchronized (this) {
            if (started || isOver()) {
                return;
            }
            started = true;
        }
        listener.started();
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
        } else {
            finish();
        }
    }

    @Override
    public void motionFinished(IMotionContainer of, IMotion motion) {
    }

    @Override
    public void motionStarted(IMotionContainer of, IMotion motion) {
        start();
    }
}
