package heptarm.doubles.motion;

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
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.PositionInformation;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.executionModel.ExecutionState;
import com.kuka.roboticsAPI.executionModel.IFiredConditionInfo;
import com.kuka.roboticsAPI.executionModel.IFiredTriggerInfo;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;
import com.kuka.roboticsAPI.motionModel.MotionBatch;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

import heptarm.core.Clock;
import heptarm.core.Clocks;
import heptarm.doubles.plant.MotionListener;
import heptarm.doubles.runtime.ApplicationServices;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.EndCause;

/** A motion that the cabinet has accepted: its state, its result, and the dispatch of its events. */
public final class MotionContainer implements IMotionContainer, MotionListener {
    /** Receives, on the dispatch thread, the end of a container. */
    public interface Ending {
        void ended(MotionContainer container);
    }

    final long id;
    private final IMotion motion;
    private final List<? extends RobotMotion<?>> parts;
    private final Station station;
    private final IMotionContainerListener listener;
    private final Ending ending;
    private final List<AppendedMotion> appended = new CopyOnWriteArrayList<>();
    private volatile Consumer<IMotion> appender;
    private volatile IMotion latest;
    private volatile boolean firstEnded;
    private volatile ServoRuntime servo;
    private volatile int part;
    private final Set<ICondition> fired = Collections.newSetFromMap(new IdentityHashMap<>());
    private ICondition broken;
    private ExecutionState state = ExecutionState.Scheduled;
    private String error;

    public MotionContainer(long id, IMotion motion, Station station, IMotionContainerListener listener, Ending ending) {
        this.id = id;
        this.motion = motion;
        this.parts = MotionTranslator.parts(motion);
        this.station = station;
        this.listener = listener;
        this.ending = ending;
    }

    /** Attaches the runtime of a servo motion, which waits for activation. */
    public void attach(ServoRuntime runtime) {
        servo = runtime;
    }

    /** Sets how a motion is appended to this one; called by the robot. */
    public void appendBy(Consumer<IMotion> submitter) {
        appender = submitter;
    }

    /** Registers an appended motion and returns its listener; called by the robot. */
    public synchronized AppendedMotion add(long number, IMotion more) {
        if (isFinished()) {
            throw new IllegalStateException("cannot append a motion: the container has ended; command a new motion");
        }
        AppendedMotion one = new AppendedMotion(this, number, more);
        appended.add(one);
        return one;
    }

    /** Withdraws an appended motion that could not be planned; called by the robot. */
    public void remove(AppendedMotion one) {
        appended.remove(one);
    }

    @Override
    public void append(IMotion more) {
        appender.accept(more);
    }

    /** An appended motion starts. */
    void appendedStarted(AppendedMotion one) {
        if (listener != null) {
            notifyMotionFinished();
            dispatch(() -> listener.motionStarted(one.motion));
        }
        latest = one.motion;
    }

    /** Reports the end of the running motion, after the end of its last segment. */
    private void notifyMotionFinished() {
        if (latest == null && !isWhole()) {
            IMotion segment = part(part);
            dispatch(() -> listener.motionFinished(segment));
        }
        IMotion ended = getLastExecutedMotion();
        dispatch(() -> listener.motionFinished(ended));
    }

    private void activate() {
        ServoRuntime runtime = servo;
        if (runtime != null) {
            runtime.activate();
        }
    }

    /** Whether this one was accepted before another. */
    public boolean precedes(MotionContainer other) {
        return id < other.id;
    }

    @Override
    public void started() {
        change(ExecutionState.Executing, null);
        activate();
        if (listener != null) {
            dispatch(() -> listener.onStateChanged(this, ExecutionState.Executing));
            if (!isWhole()) {
                dispatch(() -> listener.motionStarted(motion));
            }
            dispatch(() -> listener.motionStarted(part(0)));
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
                dispatch(() -> listener.motionFinished(done));
                dispatch(() -> listener.motionStarted(begun));
            }
        }
    }

    /** A motion of a batch or a segment of a spline; a single motion is its only part. */
    private IMotion part(int index) {
        return parts.isEmpty() ? motion : parts.get(index);
    }

    /** Whether no motion besides the parts is reported: the parts of a batch are motions, those of a spline belong to one. */
    private boolean isWhole() {
        return parts.isEmpty() || motion instanceof MotionBatch;
    }

    @Override
    public void finished(int cause, String text) {
        finished(EndCause.of(cause), text);
    }

    /** The motion has ended, or was refused; for the robot. */
    public void finished(EndCause cause, String text) {
        ExecutionState last = switch (cause) {
            case DONE, CONDITION -> ExecutionState.Finished;
            case CANCELLED -> ExecutionState.Cancelled;
            case ERROR -> ExecutionState.Error;
        };
        synchronized (this) {
            firstEnded = true;
            if (last == ExecutionState.Finished && !appended.isEmpty()) {
                return; // the last appended motion ends the container
            }
            if (!change(last, last == ExecutionState.Error ? text : null)) {
                return;
            }
        }
        dropAppended();
        activate();
        dispatch(() -> ending.ended(this));
        if (listener != null) {
            notifyMotionFinished();
            dispatch(() -> listener.onStateChanged(this, last));
            dispatch(() -> listener.containerFinished(this));
        }
    }

    /** An appended motion has ended. */
    void finished(AppendedMotion one, EndCause cause, String text) {
        appended.remove(one);
        if (firstEnded) { // otherwise it was cancelled together with everything that follows
            finished(cause, text);
        }
    }

    /** Cancels the appended motions after an early end. */
    private void dropAppended() {
        for (AppendedMotion one : appended) {
            station.dispatch.execute(() -> station.plant.cancel(one.id));
        }
    }

    /** An exception in one listener of the application must not keep the others from being called. */
    void dispatch(Runnable event) {
        station.dispatch.execute(() -> {
            try {
                event.run();
            } catch (RuntimeException e) {
                ApplicationServices.current().logger.error("a listener ended with an error", e);
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
            for (AppendedMotion one : appended) { // before the first, so that none of them begins
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
        Clock clock = station.clock();
        long deadline = station.after(time, unit);
        try {
            while (!isFinished()) {
                if (!Clocks.await(this, clock, deadline)) {
                    throw new TimeoutException("the motion did not end within " + time + " " + unit);
                }
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

    /** A condition of the motion, of one of its parts, or of an appended motion has fired. */
    void fired(RobotMotion<?> watched, boolean breaks, int index) {
        ICondition condition = breaks ? watched.breakConditions().get(index) : watched.triggerConditions().get(index);
        synchronized (this) {
            fired.add(condition);
            broken = breaks && broken == null ? condition : broken;
        }
        if (!breaks) {
            ITriggerAction action = watched.action(index);
            if (action instanceof ICallbackAction) {
                LBR robot = Station.current().robot;
                PositionInformation there = new PositionInformation(robot.getCurrentCartesianPosition(robot.getFlange()),
                        robot.getCommandedCartesianPosition(robot.getFlange()));
                dispatch(() -> ((ICallbackAction) action).onTriggerFired(new IFiredTriggerInfo() {
                    @Override
                    public IMotionContainer getMotionContainer() {
                        return MotionContainer.this;
                    }

                    @Override
                    public PositionInformation getPositionInformation() {
                        return there;
                    }
                }));
            }
        }
    }

    @Override
    public synchronized boolean hasFired(ICondition condition) {
        return fired.contains(condition);
    }

    /** The break condition that ended the motion; null while it runs or if none did. */
    @Override
    public synchronized IFiredConditionInfo getFiredBreakConditionInfo() {
        ICondition condition = broken;
        return condition == null || !isFinished() ? null : new IFiredConditionInfo() {
            @Override
            public ICondition getFiredCondition() {
                return condition;
            }

            @Override
            public String toString() {
                return "fired condition: " + condition;
            }
        };
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
