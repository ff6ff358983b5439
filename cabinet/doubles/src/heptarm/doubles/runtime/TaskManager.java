package heptarm.doubles;

import java.lang.reflect.InvocationHandler;
import java.lang.reflect.InvocationTargetException;
import java.lang.reflect.Method;
import java.lang.reflect.Modifier;
import java.lang.reflect.Proxy;
import java.util.ArrayList;
import java.util.Collection;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPIBackgroundTask;
import com.kuka.sunrise.common.task.categories.BackgroundTaskCategory;
import com.kuka.task.ITask;
import com.kuka.task.ITaskFunctionMonitor;
import com.kuka.task.ITaskInstance;
import com.kuka.task.ITaskManager;
import com.kuka.task.properties.TaskFunctionProvider;

/** The tasks of the project: starts and stops them, and finds the functions that they provide to each other. */
public final class Tasks implements ITaskManager {
    private static final long POLL_MS = 5;

    private final Station station;
    private final List<Host> hosts = new CopyOnWriteArrayList<>();

    Tasks(Station station) {
        this.station = station;
    }

    void add(Host host) {
        hosts.removeIf(one -> !one.isAlive() && one.task().getClass() == host.task().getClass());
        hosts.add(host);
    }

    /** The class of the application; null: none runs. */
    Class<?> application() {
        for (Host one : hosts) {
            if (one.task() instanceof RoboticsAPIApplication && one.isAlive()) {
                return one.task().getClass();
            }
        }
        return null;
    }

    /** Starts those of the background tasks that want it; returns whether that one does. */
    public boolean autoStart(String className) throws ReflectiveOperationException {
        Class<?> type = Class.forName(className);
        BackgroundTaskCategory category = type.getAnnotation(BackgroundTaskCategory.class);
        if (category == null || !category.autoStart() || Modifier.isAbstract(type.getModifiers())) {
            return false;
        }
        start(type);
        return true;
    }

    private Host start(Class<?> type) throws ReflectiveOperationException {
        if (!RoboticsAPIBackgroundTask.class.isAssignableFrom(type)) {
            throw new IllegalStateException(type.getName() + " is no background task; an operator starts applications");
        }
        Host host = new Host(type.getName(), station, false);
        host.start();
        return host;
    }

    /** The application has ended: so does all that runs beside it. */
    public void stopBackground() throws InterruptedException {
        for (Host one : hosts) {
            if (one.task() instanceof RoboticsAPIBackgroundTask && one.isAlive()) {
                one.stop();
            }
        }
    }

    @Override
    public ITask getTask(Class<?> type) {
        return new ITask() {
            @Override
            public ITaskInstance startInstance() throws InterruptedException {
                try {
                    return start(type);
                } catch (ReflectiveOperationException e) {
                    throw new IllegalStateException(type.getName() + " cannot be made", e);
                }
            }

            @Override
            public Collection<ITaskInstance> getInstances() {
                Collection<ITaskInstance> found = new ArrayList<>();
                for (Host one : hosts) {
                    if (one.task().getClass() == type && one.isAlive()) {
                        found.add(one);
                    }
                }
                return found;
            }

            @Override
            public void stopAllInstances() throws InterruptedException {
                for (ITaskInstance one : getInstances()) {
                    one.stop();
                }
            }
        };
    }

    /** A function as all tasks together provide it; who provides it is looked up at each call. */
    public <T> T function(Class<T> type) {
        if (!type.isInterface()) {
            throw new IllegalArgumentException("a task function is an interface, not " + type.getName());
        }
        return type.cast(Proxy.newProxyInstance(type.getClassLoader(), new Class<?>[] {type}, new Borrowed(type)));
    }

    /** Whether somebody provides what {@link #function} has returned. */
    public ITaskFunctionMonitor monitor(Object function) {
        InvocationHandler handler = Proxy.isProxyClass(function.getClass()) ? Proxy.getInvocationHandler(function) : null;
        if (!(handler instanceof Borrowed)) {
            throw new IllegalArgumentException("getTaskFunction() has not returned this: " + function);
        }
        Class<?> type = ((Borrowed) handler).type;
        return new ITaskFunctionMonitor() {
            @Override
            public boolean isAvailable() {
                return provided(type) != null;
            }

            @Override
            public boolean await(long time, TimeUnit unit) throws InterruptedException {
                long deadline = System.nanoTime() + unit.toNanos(time);
                while (!isAvailable() && System.nanoTime() < deadline) {
                    Thread.sleep(POLL_MS);
                }
                return isAvailable();
            }
        };
    }

    private Object provided(Class<?> type) {
        for (Host one : hosts) {
            for (Method method : one.isAlive() ? one.task().getClass().getMethods() : new Method[0]) {
                if (method.isAnnotationPresent(TaskFunctionProvider.class) && type.isAssignableFrom(method.getReturnType())) {
                    try {
                        method.setAccessible(true);
                        return method.invoke(one.task());
                    } catch (ReflectiveOperationException e) {
                        throw new IllegalStateException(method + " does not provide its function", e);
                    }
                }
            }
        }
        return null;
    }

    private final class Borrowed implements InvocationHandler {
        private final Class<?> type;

        Borrowed(Class<?> type) {
            this.type = type;
        }

        @Override
        public Object invoke(Object proxy, Method method, Object[] arguments) throws Throwable {
            if (method.getDeclaringClass() == Object.class) {
                return method.getName().equals("equals") ? proxy == arguments[0] : method.invoke(this, arguments);
            }
            Object provider = provided(type);
            if (provider == null) {
                throw new IllegalStateException("no task that runs provides " + type.getName());
            }
            try {
                return method.invoke(provider, arguments);
            } catch (InvocationTargetException e) {
                throw e.getCause();
            }
        }

        @Override
        public String toString() {
            return "task function " + type.getName();
        }
    }
}
