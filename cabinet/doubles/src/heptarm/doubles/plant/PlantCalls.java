package heptarm.doubles.plant;

import java.lang.reflect.InvocationHandler;
import java.lang.reflect.Method;
import java.lang.reflect.Proxy;
import java.util.Set;
import java.util.concurrent.BlockingQueue;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.LinkedBlockingQueue;

/**
 * A plant whose calls are carried out by threads of Python, which take them with {@link #next}.
 *
 * <p>The bridge keeps what it needs to pass Java objects to Python for each thread that Python knows. It knows a thread of
 * Java only while this one calls Python; it would make those things again in each call, and never free them.
 */
public final class PlantCalls implements InvocationHandler {
    /** A call that waits for its result. */
    public static final class Call {
        public final String method;
        public final Object[] arguments;
        private final Class<?> type;
        private final CountDownLatch done = new CountDownLatch(1);
        private Object result;
        private RuntimeException failure;

        Call(Method method, Object[] arguments) {
            this.method = method.getName();
            this.arguments = arguments == null ? new Object[0] : arguments;
            this.type = method.getReturnType();
        }

        /** Ends the call with its result. */
        public void returned(Object value) {
            result = type == int.class ? (Object) ((Number) value).intValue() : value;
            done.countDown();
        }

        /** Ends the call with an error: an argument that is not allowed, or a state in which the call is not possible. */
        public void failed(String text, boolean isArgument) {
            failure = isArgument ? new IllegalArgumentException(text) : new IllegalStateException(text);
            done.countDown();
        }

        private Object await() {
            boolean interrupted = false;
            while (true) {
                try {
                    done.await();
                    break;
                } catch (InterruptedException e) {
                    interrupted = true; // the call has begun, and its result matters
                }
            }
            if (interrupted) {
                Thread.currentThread().interrupt();
            }
            if (failure != null) {
                failure.fillInStackTrace(); // of the caller
                throw failure;
            }
            return result;
        }
    }

    /** Methods that change nothing. */
    private static final Set<String> QUERIES = Set.of("describe", "signal", "inverse");

    private final BlockingQueue<Call> waiting = new LinkedBlockingQueue<>();
    private volatile Runnable onChange = () -> { };

    /** Calls a runnable after each call that may have changed the plant, before its caller continues. */
    public void onChange(Runnable runnable) {
        onChange = runnable;
    }

    /** The plant as the doubles call it. */
    public Plant plant() {
        return (Plant) Proxy.newProxyInstance(Plant.class.getClassLoader(), new Class<?>[] {Plant.class}, this);
    }

    /** The next call; waits for it. */
    public Call next() throws InterruptedException {
        return waiting.take();
    }

    @Override
    public Object invoke(Object proxy, Method method, Object[] arguments) throws Throwable {
        if (method.getDeclaringClass() == Object.class) {
            return method.getName().equals("equals") ? proxy == arguments[0] : method.invoke(this, arguments);
        }
        Call call = new Call(method, arguments);
        waiting.add(call);
        try {
            return call.await();
        } finally {
            if (!QUERIES.contains(call.method)) {
                onChange.run();
            }
        }
    }
}
