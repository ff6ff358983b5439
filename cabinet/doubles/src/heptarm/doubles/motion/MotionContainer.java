package heptarm.doubles;

import java.util.Collections;
import java.util.IdentityHashMap;
import java.util.List;
import java.util.Set;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;
import java.util.function.Consumer;

import com.kuka.roboticsAPI.commandModel.ICommandRuntimeData;
import com.kuka.roboticsAPI.commandModel.IControllerCommand;
import com.kuka.roboticsAPI.conditionModel.ICallbackAction;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.ITriggerAction;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IFiredConditionInfo;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;
import com.kuka.roboticsAPI.motionModel.MotionBatch;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

/** A motion that the cabinet has accepted, and what becomes of it. */
public final class Container implements IMotionContainer, MotionListener {
    /** Called on the dispatch thread when the container has ended. */
    public interface Ending {
        void ended(Container container);
    }

    final long id;
    private final IMotion motion;
    private final List<? extends RobotMotion<?>> parts;
    private final Station station;
    private final IMotionContainerListener listener;
    private final Ending ending;
    private final List<Appended> appended = new CopyOnWriteArrayList<>();
    private volatile Consumer<IMotion> appender;
    private volatile IMotion latest;
    private volatile boolean firstEnded;
    private volatile ServoRuntime servo;
    private volatile int part;
    private final Set<ICondition> fired = Collections.newSetFromMap(new IdentityHashMap<>());
    private ICondition broken;
    private ExecutionState state = ExecutionState.Scheduled;
    private String error;

    public Container(long id, IMotion motion, Station station, IMotionContainerListener listener, Ending ending) {
        this.id = id;
        this.motion = motion;
        this.parts = Orders.parts(motion);
        this.station = station;
        this.listener = listener;
        this.ending = ending;
    }

    /** Whoever waits for the activation of a servo motion hears of it here. */
    public void serve(ServoRuntime runtime) {
        servo = runtime;
    }

    /** How a motion is put behind this one; for the robot. */
    public void appendBy(Consumer<IMotion> way) {
        appender = way;
    }

    /** The listener of a motion that is put behind; for the robot. */
    public synchronized Appended add(long number, IMotion more) {
        if (isFinished()) {
            throw new IllegalStateException("the motion has ended; nothing can be appended");
        }
        Appended one = new Appended(this, number, more);
        appended.add(one);
        return one;
    }

    /** It could not be planned after all; for the robot. */
    public void without(Appended one) {
        appended.remove(one);
    }

    @Override
    public void append(IMotion more) {
        appender.accept(more);
    }

    /** An appended motion begins. */
    void begins(Appended one) {
        if (listener != null) {
            tellFinished();
            tell(() -> listener.motionStarted(one.motion));
        }
        latest = one.motion;
    }

    /** The end of the motion that ran, before that the end of its last segment. */
    private void tellFinished() {
        if (latest == null && !isWhole()) {
            IMotion segment = part(part);
            tell(() -> listener.motionFinished(segment));
        }
        IMotion ended = getLastExecutedMotion();
        tell(() -> listener.motionFinished(ended));
    }

    private void activate() {
        ServoRuntime runtime = servo;
        if (runtime != null) {
            runtime.activate();
        }
    }

    /** Whether this one was accepted before another. */
    public boolean precedes(Container other) {
        return id < other.id;
    }

    @Override
    public void started() {
        change(ExecutionState.Executing, null);
        activate();
        if (listener != null) {
            tell(() -> listener.onStateChanged(this, ExecutionState.Executing));
            if (!isWhole()) {
                tell(() -> listener.motionStarted(motion));
            }
            tell(() -> listener.motionStarted(part(0)));
        }
    }

    @Override
    public void reached(int next) {
        int before = part;
        part = next;
        if (listener != null) {
            for (int i = before; i < next; i++) {
                IMotion done = part(i);
                IMotion begun = part(i + 1);
                tell(() -> listener.motionFinished(done));
                tell(() -> listener.motionStarted(begun));
            }
        }
    }

    /** A motion of the batch or segment of the spline; a motion by itself is its only part. */
    private IMotion part(int index) {
        return parts.isEmpty() ? motion : parts.get(index);
    }

    /** Whether its parts are all that it is: a batch's are motions, those of a spline belong to one. */
    private boolean isWhole() {
        return parts.isEmpty() || motion instanceof MotionBatch;
    }

    @Override
    public void finished(String cause, String text) {
        ExecutionState last = "done".equals(cause) || "condition".equals(cause) ? ExecutionState.Finished
                : "cancelled".equals(cause) ? ExecutionState.Cancelled : ExecutionState.Error;
        synchronized (this) {
            firstEnded = true;
            if (last == ExecutionState.Finished && !appended.isEmpty()) {
                return; // the last of the appended ones ends it
            }
            if (!change(last, last == ExecutionState.Error ? text : null)) {
                return;
            }
        }
        dropAppended();
        activate();
        tell(() -> ending.ended(this));
        if (listener != null) {
            tellFinished();
            tell(() -> listener.onStateChanged(this, last));
            tell(() -> listener.containerFinished(this));
        }
    }

    /** An appended motion has ended. */
    void finished(Appended one, String cause, String text) {
        appended.remove(one);
        if (firstEnded) { // otherwise it was cancelled before its time, with all that is to come
            finished(cause, text);
        }
    }

    /** What was appended does not run after an end before its time. */
    private void dropAppended() {
        for (Appended one : appended) {
            station.dispatch.execute(() -> station.plant.cancel(one.id));
        }
    }

    /** An exception of the application's listener must not keep others from being told. */
    private void tell(Runnable news) {
        station.dispatch.execute(() -> {
            try {
                news.run();
            } catch (RuntimeException e) {
                Desk.current().logger.error("a listener ended with an error", e);
            }
        });
    }

    private synchronized boolean change(ExecutionState next, String text) {
        if (isFinished()) {
            return false;
        }
        state = next;
        error = text;
        notifyAll();
        return true;
    }

    @Override
    public synchronized boolean isFinished() {
        return state == ExecutionState.Finished || state == ExecutionState.Cancelled || state == ExecutionState.Error;
    }

    @Override
    public synchronized boolean hasError() {
        return state == ExecutionState.Error;
    }

    @Override
    public synchronized String getErrorMessage() {
        return error;
    }

    @Override
    public synchronized ExecutionState getState() {
        return state;
    }

    @Override
    public void cancel() {
        if (!isFinished()) {
            for (Appended one : appended) { // before the first, so that none of them begins
                station.plant.cancel(one.id);
            }
            station.plant.cancel(id);
        }
    }

    @Override
    public synchronized void await() {
        try {
            while (!isFinished()) {
                wait();
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new IllegalStateException("interrupted while waiting for a motion", e);
        }
    }

    @Override
    public synchronized void await(long time, TimeUnit unit) throws TimeoutException {
        long deadline = System.nanoTime() + unit.toNanos(time);
        try {
            while (!isFinished()) {
                long left = deadline - System.nanoTime();
                if (left <= 0) {
                    throw new TimeoutException("the motion has not ended within " + time + " " + unit);
                }
                TimeUnit.NANOSECONDS.timedWait(this, left);
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new IllegalStateException("interrupted while waiting for a motion", e);
        }
    }

    @Override
    public IMotion getCurrentMotion() {
        return isFinished() ? null : getLastExecutedMotion();
    }

    @Override
    public IMotion getLastExecutedMotion() {
        return latest != null ? latest : isWhole() ? part(part) : motion;
    }

    @Override
    public void fired(int of, boolean breaks, int index) {
        fired(of < 0 ? (RobotMotion<?>) motion : parts.get(of), breaks, index);
    }

    /** A condition of the motion, of a part of it, or of one that was appended, has fired. */
    void fired(RobotMotion<?> watched, boolean breaks, int index) {
        ICondition condition = breaks ? watched.breakConditions().get(index) : watched.triggerConditions().get(index);
        synchronized (this) {
            fired.add(condition);
            broken = breaks && broken == null ? condition : broken;
        }
        if (!breaks) {
            ITriggerAction action = watched.action(index);
            if (action instanceof ICallbackAction) {
                tell(() -> ((ICallbackAction) action).onTriggerFired(() -> this));
            }
        }
    }

    @Override
    public synchronized boolean hasFired(ICondition condition) {
        return fired.contains(condition);
    }

    /** What ended the motion; null while it runs, and if no condition did. */
    @Override
    public synchronized IFiredConditionInfo getFiredBreakConditionInfo() {
        ICondition condition = broken;
        return condition == null || !isFinished() ? null : () -> condition;
    }

    @Override
    public void validate() {
        if (hasError()) {
            throw new CommandInvalidException(getErrorMessage());
        }
    }

    @Override
    public ICommandRuntimeData getRuntimeData() {
        return new ICommandRuntimeData() {
            @Override
            public String toString() {
                return getCommand() + ", " + getState() + ", " + fired.size() + " conditions have fired";
            }
        };
    }

    @Override
    public IControllerCommand getCommand() {
        return new IControllerCommand() {
            @Override
            public String toString() {
                return motion.getClass().getSimpleName() + " " + id;
            }
        };
    }
}
