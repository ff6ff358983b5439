package heptarm.doubles.runtime;

import java.lang.annotation.Annotation;
import java.lang.reflect.Constructor;
import java.lang.reflect.Executable;
import java.lang.reflect.Field;
import java.lang.reflect.Method;
import java.lang.reflect.Modifier;
import java.util.HashMap;
import java.util.HashSet;
import java.util.Map;
import java.util.Set;

import javax.annotation.PostConstruct;
import javax.inject.Inject;
import javax.inject.Named;
import javax.inject.Singleton;

import com.kuka.roboticsAPI.RoboticsAPIContext;
import com.kuka.roboticsAPI.annotations.AutomaticResumeManager;
import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.conditionModel.ObserverManager;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseController;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;
import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;
import com.kuka.roboticsAPI.uiModel.IApplicationUI;
import com.kuka.task.ITaskLogger;
import com.kuka.task.ITaskManager;

/** Injects objects of the cabinet, process data, tools by template name and classes of the project into a task. */
final class Injector {
    private final ApplicationServices services;
    private final Station station;
    private final Object[] offers;
    private final Class<?>[] types;
    private final Map<Class<?>, Object> singletons = new HashMap<>();
    private final Set<Class<?>> underConstruction = new HashSet<>();

    Injector(ApplicationServices services, Station station) {
        this.services = services;
        this.station = station;
        this.types = new Class<?>[] {station.robot.getClass(), SunriseController.class, Controller.class, IApplicationData.class,
            ITaskLogger.class, IApplicationUI.class, ObserverManager.class, IApplicationControl.class, RoboticsAPIContext.class,
            ITaskManager.class, AutomaticResumeManager.class};
        this.offers = new Object[] {station.robot, station.controller, station.controller, services, services.logger, services.pad,
            services.observers, services, station.context, station.tasks, station.automaticResume.manager};
    }

    /** Injects into annotated fields and methods; superclasses first, up to the first class of the cabinet. */
    private void fill(Object target) throws ReflectiveOperationException {
        fill(target, target.getClass());
        construct(target, target.getClass());
    }

    private void construct(Object target, Class<?> c) throws ReflectiveOperationException {
        if (c == null || isForeign(c)) {
            return;
        }
        construct(target, c.getSuperclass());
        for (Method method : c.getDeclaredMethods()) {
            if (method.isAnnotationPresent(PostConstruct.class)) {
                method.setAccessible(true);
                method.invoke(target);
            }
        }
    }

    private void fill(Object target, Class<?> c) throws ReflectiveOperationException {
        if (c == null || isForeign(c)) {
            return;
        }
        fill(target, c.getSuperclass());
        for (Field field : c.getDeclaredFields()) {
            if (field.isAnnotationPresent(Inject.class)) {
                field.setAccessible(true);
                field.set(target, find(field.getType(), field.getAnnotation(Named.class), field.toString()));
            }
        }
        for (Method method : c.getDeclaredMethods()) {
            if (method.isAnnotationPresent(Inject.class)) {
                method.setAccessible(true);
                method.invoke(target, arguments(method));
            }
        }
    }

    private Object find(Class<?> type, Named named, String where) throws ReflectiveOperationException {
        if (Device.class.isAssignableFrom(type) && (named != null || !type.isInstance(station.robot))) {
            return device(type, named, where);
        }
        try {
            if (named != null && PhysicalObject.class.isAssignableFrom(type)) {
                return services.createFromTemplate(named.value());
            }
            if (named != null && type == IProcessData.class) {
                return services.getProcessData(named.value());
            }
        } catch (PersistenceException e) {
            throw new PersistenceException("nothing to inject into " + where + ": " + e.getMessage());
        }
        for (int i = 0; i < types.length; i++) {
            if (type.isAssignableFrom(types[i])) {
                return offers[i];
            }
        }
        if (isForeign(type) || type.isInterface() || Modifier.isAbstract(type.getModifiers())) {
            throw new IllegalArgumentException("nothing to inject into " + where);
        }
        Object made = singletons.get(type);
        return made == null ? make(type, where) : made;
    }

    /** The robot, by its name in the station setup if one is given. */
    private Object device(Class<?> type, Named named, String where) {
        String present = station.robot.getName();
        if (named != null && !present.equals(named.value()) || !type.isInstance(station.robot)) {
            throw new IllegalArgumentException("nothing to inject into " + where + ": the virtual cabinet's robot is " + present
                    + ", not " + (named == null ? "a " + type.getName() : named.value()) + "; choose another robot with --model");
        }
        return station.robot;
    }

    /** Whether a class is none of the project's. */
    private static boolean isForeign(Class<?> type) {
        String name = type.getName();
        return type.isPrimitive() || name.startsWith("java.")
                || name.startsWith("com.kuka.") && !name.startsWith("com.kuka.generated.");
    }

    /** A new object of a class of the project, by its constructor for injection or the one without parameters. */
    Object make(Class<?> type, String where) throws ReflectiveOperationException {
        Constructor<?> chosen = null;
        for (Constructor<?> one : type.getDeclaredConstructors()) {
            if (one.isAnnotationPresent(Inject.class) || chosen == null && one.getParameterCount() == 0) {
                chosen = one;
            }
        }
        if (chosen == null) {
            throw new IllegalArgumentException("nothing to inject into " + where + ": " + type.getName()
                    + " has neither a constructor with @Inject nor one without parameters");
        }
        chosen.setAccessible(true);
        if (!underConstruction.add(type)) {
            throw new IllegalArgumentException("nothing to inject into " + where + ": to construct a " + type.getName()
                    + " takes another one, and so on; inject a field, or mark the class @Singleton");
        }
        try {
            Object made = chosen.newInstance(arguments(chosen));
            if (type.isAnnotationPresent(Singleton.class)) {
                singletons.put(type, made); // before its fields: two of them may know each other
            }
            fill(made);
            return made;
        } finally {
            underConstruction.remove(type);
        }
    }

    private Object[] arguments(Executable called) throws ReflectiveOperationException {
        Object[] arguments = new Object[called.getParameterCount()];
        for (int i = 0; i < arguments.length; i++) {
            Named named = null;
            for (Annotation one : called.getParameterAnnotations()[i]) {
                named = one instanceof Named ? (Named) one : named;
            }
            arguments[i] = find(called.getParameterTypes()[i], named, called.toString());
        }
        return arguments;
    }
}
