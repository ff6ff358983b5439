package heptarm.doubles.runtime;

import java.lang.reflect.InvocationTargetException;
import java.util.HashSet;
import java.util.Set;
import java.util.TreeSet;
import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPITask;
import com.kuka.task.ITaskInstance;

import heptarm.doubles.plant.Plant;

/** Runs one application or background task as the cabinet does: inject, initialize, run, and always dispose. */
public final class TaskRunner implements ITaskInstance {
    private static final long STOP_TIMEOUT_MS = 5000;
    /** Threads that dispose() has asked to end may need a moment. */
    private static final long THREADS_END_MS = 500;

    private final RoboticsAPITask task;
    private final Thread thread;
    private final ApplicationServices services;
    private final Plant plant;
    private final boolean isApplication;
    private final Set<Thread> before = new HashSet<>(Thread.getAllStackTraces().keySet());
    private volatile boolean stopping;
    private volatile String reason;
    private volatile Throwable failure;

    /** Creates the application. */
    public TaskRunner(String className) throws ReflectiveOperationException {
        this(className, Station.current(), true);
    }

    /** Creates a program of heptarm's beside the application: it starts and ends without any effect on the application's motions. */
    public static TaskRunner beside(String className) throws ReflectiveOperationException {
        return new TaskRunner(className, Station.current(), false);
    }

    TaskRunner(String className, Station station, boolean isApplication) throws ReflectiveOperationException {
        plant = station.plant;
        this.isApplication = isApplication;
        services = new ApplicationServices(station, this::terminate);
        if (isApplication) {
            services.becomeApplication();
        }
        ApplicationServices previous = services.enter();
        try {
            task = create(className, new Injector(services, station));
            thread = new Thread(this::runTask, isApplication ? "application" : task.getClass().getSimpleName());
        } finally {
            ApplicationServices.leave(previous);
        }
        thread.setDaemon(!isApplication); // as are the threads that it starts, by which reportThreads() knows them
        station.tasks.add(this);
    }

    /** The task with everything injected; an error in its own code is logged with the place, and named. */
    private RoboticsAPITask create(String className, Injector injector) throws ReflectiveOperationException {
        Throwable cause;
        try {
            return (RoboticsAPITask) injector.make(Class.forName(className), className);
        } catch (InvocationTargetException | ExceptionInInitializerError e) {
            cause = e.getCause();
        } catch (LinkageError e) {
            cause = e;
        }
        if (isApplication) {
            services.logger.error(className + " cannot be created", cause);
        }
        throw new IllegalStateException(className + " cannot be created: " + cause, cause);
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
        } catch (Throwable e) { // an Error, too, would be lost with this thread
            services.logger.error("dispose() ended with an error", e);
            if (failure == null) {
                failure = e;
            }
        }
        if (isApplication) {
            reportThreads();
        }
    }

    /** Names the threads that the application has left behind: in a cabinet they live on, and their ports stay bound. */
    private void reportThreads() {
        long deadline = System.nanoTime() + TimeUnit.MILLISECONDS.toNanos(THREADS_END_MS);
        Set<String> left = new TreeSet<>();
        for (Thread one : Thread.getAllStackTraces().keySet()) {
            if (one == Thread.currentThread() || one.isDaemon() || before.contains(one)) {
                continue;
            }
            try {
                one.join(Math.max(1, TimeUnit.NANOSECONDS.toMillis(deadline - System.nanoTime())));
            } catch (InterruptedException e) {
                Thread.currentThread().interrupt();
                return; // the operator does not wait
            }
            if (one.isAlive()) {
                left.add(one.getName());
            }
        }
        if (!left.isEmpty()) {
            services.logger.warn("the application has ended, its threads have not: " + String.join(", ", left)
                    + "; in a cabinet they run on and keep their ports: end them in dispose()");
        }
    }

    private void terminate(String why) {
        reason = why;
        stopping = true;
        try {
            if (task instanceof RoboticsAPIApplication) {
                ((RoboticsAPIApplication) task).onApplicationStateChanged(RoboticsAPIApplicationState.STOPPING);
            }
        } finally {
            if (isApplication) {
                plant.cancelAll();
            }
            thread.interrupt();
        }
    }

    /** Deselects the task, as an operator at the smartPAD does, and waits for its end. */
    @Override
    public void stop() throws InterruptedException {
        terminate(null);
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

    /** The error that ended the task, whose thread may only have been interrupted after it; null if there was none. */
    public String failure() {
        String why = reason;
        return why != null ? why : failure == null ? null : failure.toString();
    }
}
