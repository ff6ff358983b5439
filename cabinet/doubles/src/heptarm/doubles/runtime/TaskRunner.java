package heptarm.doubles.runtime;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPITask;
import com.kuka.task.ITaskInstance;

import heptarm.doubles.plant.Plant;

/** Runs one application or background task as the cabinet does: inject, initialize, run, and always dispose. */
public final class TaskRunner implements ITaskInstance {
    private static final long STOP_TIMEOUT_MS = 5000;

    private final RoboticsAPITask task;
    private final Thread thread;
    private final ApplicationServices services;
    private final Plant plant;
    private volatile boolean stopping;
    private volatile Throwable failure;

    /** Creates the application. */
    public TaskRunner(String className) throws ReflectiveOperationException {
        this(className, Station.current(), true);
    }

    TaskRunner(String className, Station station, boolean isApplication) throws ReflectiveOperationException {
        plant = station.plant;
        services = new ApplicationServices(station, this::terminate);
        if (isApplication) {
            services.becomeApplication();
        }
        ApplicationServices previous = services.enter();
        try {
            task = (RoboticsAPITask) Class.forName(className).getDeclaredConstructor().newInstance();
            new Injector(services, station).fill(task);
            thread = new Thread(this::runTask, isApplication ? "application" : task.getClass().getSimpleName());
        } finally {
            ApplicationServices.leave(previous);
        }
        thread.setDaemon(true);
        station.tasks.add(this);
    }

    public void start() {
        thread.start();
    }

    private void runTask() {
        services.enter();
        try {
            task.initialize();
            task.run();
        } catch (Throwable e) { // as on the cabinet, the task is disposed after any error
            boolean isApplication = task instanceof RoboticsAPIApplication;
            if (isApplication || !stopping) {
                failure = e;
                services.logger.error("the " + (isApplication ? "application" : "background task") + " ended with an error", e);
            }
            if (isApplication) {
                plant.cancelAll();
            }
        } finally {
            dispose();
        }
    }

    private void dispose() {
        services.observers.close();
        try {
            task.dispose();
        } catch (RuntimeException e) {
            services.logger.error("dispose() ended with an error", e);
            if (failure == null) {
                failure = e;
            }
        }
    }

    private void terminate() {
        stopping = true;
        try {
            if (task instanceof RoboticsAPIApplication) {
                ((RoboticsAPIApplication) task).onApplicationStateChanged(RoboticsAPIApplicationState.STOPPING);
            }
        } finally {
            if (task instanceof RoboticsAPIApplication) {
                plant.cancelAll();
            }
            thread.interrupt();
        }
    }

    /** Deselects the task, as an operator at the smartPAD does, and waits for its end. */
    @Override
    public void stop() throws InterruptedException {
        terminate();
        thread.join(STOP_TIMEOUT_MS);
    }

    public boolean isAlive() {
        return thread.isAlive();
    }

    @Override
    public boolean isRunning() {
        return isAlive();
    }

    RoboticsAPITask task() {
        return task;
    }

    /** The error that ended the task; null if there was none. */
    public String failure() {
        return failure == null ? null : failure.toString();
    }
}
