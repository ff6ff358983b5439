package sample;

import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicInteger;

import javax.inject.Inject;

import com.kuka.roboticsAPI.annotations.AutomaticResumeManager;
import com.kuka.roboticsAPI.annotations.IAutomaticResumeFunction;
import com.kuka.roboticsAPI.applicationModel.tasks.CycleBehavior;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPICyclicBackgroundTask;
import com.kuka.sunrise.common.task.categories.BackgroundTaskCategory;
import com.kuka.task.ITaskLogger;
import com.kuka.task.properties.TaskFunctionProvider;

/** Counts, from the start of the cabinet on, and lets applications go on after a stop. */
@BackgroundTaskCategory(autoStart = true)
public class Counting extends RoboticsAPICyclicBackgroundTask implements ICounter {
    @Inject
    private AutomaticResumeManager resuming;
    @Inject
    private ITaskLogger log;
    private final AtomicInteger cycles = new AtomicInteger();

    @Override
    public void initialize() {
        initializeCyclic(0, 10, TimeUnit.MILLISECONDS, CycleBehavior.BestEffort);
    }

    @Override
    public void runCyclic() {
        if (cycles.incrementAndGet() < 0) {
            getCyclicFuture().cancel(true);
        }
    }

    @Override
    public int count() {
        return cycles.get();
    }

    @Override
    public void reset() {
        cycles.set(0);
    }

    @TaskFunctionProvider
    public ICounter getCounter() {
        return this;
    }

    @TaskFunctionProvider
    public IAutomaticResumeFunction getResuming() {
        return resuming;
    }

    @Override
    public void dispose() {
        log.fine("counted " + cycles);
        super.dispose();
    }
}
