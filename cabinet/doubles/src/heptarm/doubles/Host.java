package heptarm.doubles;

import java.lang.reflect.Field;

import javax.inject.Inject;
import javax.inject.Named;

import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.conditionModel.ObserverManager;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.uiModel.IApplicationUI;
import com.kuka.task.ITaskLogger;

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
        inject(station);
        thread = new Thread(this::live, "application");
        thread.setDaemon(true);
    }

    private void inject(Station station) throws IllegalAccessException {
        Object[] offers = {station.robot, station.controller, desk, desk.logger, desk.pad, desk.observers};
        Class<?>[] types = {LBR.class, Controller.class, IApplicationData.class, ITaskLogger.class, IApplicationUI.class,
            ObserverManager.class};
        for (Class<?> c = application.getClass(); c != RoboticsAPIApplication.class; c = c.getSuperclass()) {
            for (Field field : c.getDeclaredFields()) {
                if (!field.isAnnotationPresent(Inject.class)) {
                    continue;
                }
                field.setAccessible(true);
                Object found = field.getType() == IApplicationControl.class ? desk : null;
                if (field.isAnnotationPresent(Named.class) && PhysicalObject.class.isAssignableFrom(field.getType())) {
                    found = desk.createFromTemplate(field.getAnnotation(Named.class).value());
                }
                for (int i = 0; i < types.length && found == null; i++) {
                    found = field.getType().isAssignableFrom(types[i]) ? offers[i] : null;
                }
                if (found == null) {
                    throw new IllegalArgumentException("nothing to inject into " + field);
                }
                field.set(application, found);
            }
        }
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
