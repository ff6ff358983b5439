package heptarm.doubles;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;

/** Runs one application as the cabinet does: inject, initialize, run, and dispose whatever happens. */
public final class Host {
    private static final long PATIENCE_MS = 5000;

    private final RoboticsAPIApplication application;
    private final Thread thread;
    private final Desk desk;
    private final Plant plant;
    private volatile Throwable failure;

    public Host(String className) throws ReflectiveOperationException {
        Station station = Station.current();
        plant = station.plant;
        desk = new Desk(station, this::terminate);
        application = (RoboticsAPIApplication) Class.forName(className).getDeclaredConstructor().newInstance();
        new Injector(desk, station).fill(application);
        thread = new Thread(this::live, "application");
        thread.setDaemon(true);
    }

    public void start() {
        thread.start();
    }

    private void live() {
        try {
            application.initialize();
            application.run();
        } catch (Throwable e) { // as on the cabinet: whatever it was, the application is disposed
            failure = e;
            desk.logger.error("the application ended with an error", e);
            plant.cancelAll();
        } finally {
            dispose();
        }
    }

    private void dispose() {
        desk.observers.close();
        try {
            application.dispose();
        } catch (RuntimeException e) {
            desk.logger.error("dispose() ended with an error", e);
            if (failure == null) {
                failure = e;
            }
        }
    }

    private void terminate() {
        try {
            application.onApplicationStateChanged(RoboticsAPIApplicationState.STOPPING);
        } finally {
            plant.cancelAll();
            thread.interrupt();
        }
    }

    /** Deselects the application, as a person at the smartPAD does; true if it ended in time. */
    public boolean stop() throws InterruptedException {
        terminate();
        thread.join(PATIENCE_MS);
        return !thread.isAlive();
    }

    public boolean isAlive() {
        return thread.isAlive();
    }

    /** What ended the application; null if nothing did. */
    public String failure() {
        return failure == null ? null : failure.toString();
    }
}
