package cell;

import java.util.concurrent.TimeUnit;

import javax.inject.Inject;

import com.kuka.generated.ioAccess.CellIOGroup;
import com.kuka.roboticsAPI.applicationModel.tasks.CycleBehavior;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPICyclicBackgroundTask;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.sunrise.common.task.categories.BackgroundTaskCategory;
import com.kuka.task.properties.TaskFunctionProvider;

/** Lights the lamp while the arm moves, and counts how often the gripper closes; it runs as long as the cabinet does. */
@BackgroundTaskCategory(autoStart = true)
public class CellWatcher extends RoboticsAPICyclicBackgroundTask implements ICounter {
    @Inject
    private LBR lbr;
    @Inject
    private CellIOGroup io;
    private volatile int closings;
    private boolean wasClosed;

    @Override
    public void initialize() {
        initializeCyclic(0, 20, TimeUnit.MILLISECONDS, CycleBehavior.BestEffort);
    }

    @Override
    public void runCyclic() {
        io.setLamp(lbr.hasActiveMotionCommand());
        boolean closed = io.getGrip();
        if (closed && !wasClosed) {
            closings = closings + 1;
        }
        wasClosed = closed;
    }

    @Override
    public int closings() {
        return closings;
    }

    @TaskFunctionProvider
    public ICounter getCounter() {
        return this;
    }
}
