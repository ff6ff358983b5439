package heptarm.doubles;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPITask;
import com.kuka.task.ITaskInstance;

/** Runs one application or background task as the cabinet does: inject, initialize, run, and dispose whatever happens. */
public final class Host implements ITaskInstance {
    private static final long PATIENCE_MS = 5000;

    private final RoboticsAPITask task;
    private final Thread thread;
    private final Desk desk;
    private final Plant plant;
    private volatile boolean stopping;
    private volatile Throwable failure;

    /** Makes the application. */
    public Host(String className) throws ReflectiveOperationException {
        this(className, Station.current(), true);
    }

    Host(String className, Station station, boolean leads) throws ReflectiveOperationException {
        plant = station.plant;
        desk = new Desk(station, this::terminate);
        if (leads) {
            desk.leads();
        }
        Desk before = desk.enter();
        try {
            task = (RoboticsAPITask) Class.forName(className).getDeclaredConstructor().newInstance();
            new Injector(desk, station).fill(task);
            thread = new Thread(this::live, leads ? "application" : task.getClass().getSimpleName());
        } finally {
            Desk.leave(before);
        }
        thread.setDaemon(true);
        station.tasks.add(this);
    }

    public void start() {
        thread.start();
    }

    private void live() {
        desk.enter();
        try {
            task.initialize();
            task.run();
        } catch (Throwable e) { // as on the cabinet: whatever it was, the task is disposed
            boolean isApplication = task instanceof RoboticsAPIApplication;
            if (isApplication || !stopping) {
                failure = e;
                desk.logger.error("the " + (isApplication ? "application" : "background task") + " ended with an error", e);
            }
            if (isApplication) {
                plant.cancelAll();
            }
        } finally {
            dispose();
        }
    }

    private void dispose() {
        desk.observers.close();
        try {
            task.dispose();
        } catch (RuntimeException e) {
            desk.logger.error("dispose() ended with an error", e);
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

    /** Deselects it, as a person at the smartPAD does, and waits for its end. */
    @Override
    public void stop() throws InterruptedException {
        terminate();
        thread.join(PATIENCE_MS);
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

    /** What ended it; null if nothing did. */
    public String failure() {
        return failure == null ? null : failure.toString();
    }
}
