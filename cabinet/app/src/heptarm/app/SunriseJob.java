package heptarm.app;

import java.util.ArrayList;
import java.util.List;

import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IExecutionContainer;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

import heptarm.core.robot.ContainerJob;
import heptarm.core.robot.MotionJob;

/** A motion container of Sunrise as a job of the core. */
class SunriseJob extends ContainerJob implements IMotionContainerListener {
    /** Segments of a spline, which some cabinets report one by one. */
    final List<IMotion> segments = new ArrayList<IMotion>();
    private BreakConditions until;
    private IMotionContainer container;

    SunriseJob(MotionJob.Listener listener) {
        super(listener);
    }

    /** Let conditions end a motion. */
    void breakWhen(RobotMotion<?> motion, BreakConditions conditions) {
        until = conditions;
        conditions.addTo(motion, listener);
    }

    /** Set the container that moveAsync has returned. */
    void set(IMotionContainer moved) {
        container = moved;
        accepted();
    }

    @Override
    protected void cancelContainer() {
        container.cancel();
    }

    public void onStateChanged(IExecutionContainer changed, ExecutionState state) {
    }

    public void containerFinished(IMotionContainer finished) {
        if (finished.hasError()) {
            fail(finished.getErrorMessage());
        } else if (finished.getFiredBreakConditionInfo() != null) {
            if (until != null) {
                until.report(finished, listener);
            }
            end(Outcome.CONDITION, 0, "");
        } else {
            finish();
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
