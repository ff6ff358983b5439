package heptarm.doubles.runtime;

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

/** Starts and stops the tasks of the project and resolves the task functions that they provide to each other. */
public final class TaskManager implements ITaskManager {
    private static final long POLL_MS = 5;

    private final Station station;
    private final List<TaskRunner> hosts = new CopyOnWriteArrayList<>();

    TaskManager(Station station) {
        this.station = station;
    }

    void add(TaskRunner host) {
        hosts.removeIf(one -> !one.isAlive() && one.task().getClass() == host.task().getClass());
        hosts.add(host);
    }

    /** Class of the running application; null: none runs. */
    Class<?> application() {
        for (TaskRunner one : hosts) {
            if (one.task() instanceof RoboticsAPIApplication && one.isAlive()) {
                return one.task().getClass();
            }
        }
        return null;
    }

    /** Starts a background task whose category requests automatic start; returns whether it was started. */
    public boolean autoStart(String className) throws ReflectiveOperationException {
        Class<?> type = Class.forName(className);
        BackgroundTaskCategory category = type.getAnnotation(BackgroundTaskCategory.class);
        if (category == null || !category.autoStart() || Modifier.isAbstract(type.getModifiers())) {
            return false;
        }
        try {
            start(type);
        } catch (RuntimeException e) { // the application starts all the same
            ApplicationServices.current().logger.error("the background task " + className + " does not start", e);
            return false;
        }
        return true;
    }

    private TaskRunner start(Class<?> type) throws ReflectiveOperationException {
        if (!RoboticsAPIBackgroundTask.class.isAssignableFrom(type)) {
            throw new IllegalStateException(type.getName() + " is not a background task; only the operator starts applications");
        }
        TaskRunner host = new TaskRunner(type.getName(), station, false);
        host.start();
        return host;
    }

    /** Stops all background tasks after the end of the application. */
    public void stopBackground() throws InterruptedException {
        for (TaskRunner one : hosts) {
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
                    throw new IllegalStateException(type.getName() + " cannot be created", e);
                }
            }

            @Override
            public Collection<ITaskInstance> getInstances() {
                Collection<ITaskInstance> found = new ArrayList<>();
                for (TaskRunner one : hosts) {
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

    /** A task function; its provider is looked up at each call. */
    public <T> T function(Class<T> type) {
        if (!type.isInterface()) {
            throw new IllegalArgumentException("a task function must be an interface, got " + type.getName());
        }
        return type.cast(Proxy.newProxyInstance(type.getClassLoader(), new Class<?>[] {type}, new FunctionProxy(type)));
    }

    /** Monitors whether a running task provides a function that {@link #function} returned. */
    public ITaskFunctionMonitor monitor(Object function) {
        InvocationHandler handler = Proxy.isProxyClass(function.getClass()) ? Proxy.getInvocationHandler(function) : null;
        if (!(handler instanceof FunctionProxy)) {
            throw new IllegalArgumentException("not a task function of getTaskFunction(): " + function);
        }
        Class<?> type = ((FunctionProxy) handler).type;
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
        for (TaskRunner one : hosts) {
            for (Method method : one.isAlive() ? one.task().getClass().getMethods() : new Method[0]) {
                if (method.isAnnotationPresent(TaskFunctionProvider.class) && type.isAssignableFrom(method.getReturnType())) {
                    try {
                        method.setAccessible(true);
                        return method.invoke(one.task());
                    } catch (ReflectiveOperationException e) {
                        throw new IllegalStateException(method + " failed to provide its task function", e);
                    }
                }
            }
        }
        return null;
    }

    private final class FunctionProxy implements InvocationHandler {
        private final Class<?> type;

        FunctionProxy(Class<?> type) {
            this.type = type;
        }

        @Override
        public Object invoke(Object proxy, Method method, Object[] arguments) throws Throwable {
            if (method.getDeclaringClass() == Object.class) {
                return method.getName().equals("equals") ? proxy == arguments[0] : method.invoke(this, arguments);
            }
            Object provider = provided(type);
            if (provider == null) {
                throw new IllegalStateException("no running task provides " + type.getName());
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
