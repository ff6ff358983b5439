package heptarm.app;

import java.util.IdentityHashMap;
import java.util.Iterator;
import java.util.List;
import java.util.Map;

import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseExecutionService;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IErrorHandler;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.PositionHold;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.FriSession;
import heptarm.core.robot.MotionJob;
import heptarm.core.robot.MotionPort;
import heptarm.core.robot.ServoJob;
import heptarm.core.robot.SimulatorProbe;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.FriOpen;
import heptarm.wire.HandGuide;
import heptarm.wire.Item;
import heptarm.wire.Mode;
import heptarm.wire.ServoOpen;

/** Motions of Sunrise behind the core's port: starts, cancels and pauses them, and reports their errors to their listeners. */
final class SunriseMotions implements MotionPort, IErrorHandler {
    private final LBR lbr;
    private final SunriseTools tools;
    private final SunriseSignals signals;
    private final SunriseExecutionService execution;
    private final IApplicationControl control;
    private final SimulatorProbe probe;
    private final Log log;
    private final MotionBuilder builder;
    private final ControlModes modes;
    private final Map<IMotionContainer, SunriseJob> jobs = new IdentityHashMap<IMotionContainer, SunriseJob>();
    private final Map<IMotionContainer, String> orphans = new IdentityHashMap<IMotionContainer, String>();

    /** Probe: null on a real robot. */
    SunriseMotions(LBR lbr, SunriseTools tools, SunriseSignals signals, SunriseExecutionService execution, IApplicationControl control,
            SimulatorProbe probe, Log log) {
        this.lbr = lbr;
        this.tools = tools;
        this.signals = signals;
        this.execution = execution;
        this.control = control;
        this.probe = probe;
        this.log = log;
        this.modes = new ControlModes(tools);
        this.builder = new MotionBuilder(lbr, tools, modes);
        control.registerMoveAsyncErrorHandler(this);
    }

    public boolean monitors(Condition condition) {
        return BreakConditions.isSupported(condition);
    }

    public void check(Item item, String path) throws CommandRejected {
        builder.check(item, path);
        if (item.motion instanceof HandGuide) {
            try {
                SunriseHandGuiding.of((HandGuide) item.motion, lbr);
            } catch (LinkageError e) {
                throw new CommandRejected(Code.UNSUPPORTED, path + "motion", "HandGuide", "", "hand guiding is not installed on this cabinet (" + e + "); install that option");
            }
        }
    }

    public MotionJob start(Item item, Mode mode, MotionJob.Listener listener) throws CommandRejected {
        if (item.motion instanceof HandGuide) {
            return startPlain(SunriseHandGuiding.of((HandGuide) item.motion, lbr), item.frame, listener);
        }
        SunriseJob job = new SunriseJob(listener);
        try {
            RobotMotion<?> motion = builder.motion(item, mode, job.segments);
            job.breakWhen(motion, BreakConditions.of(item.until, tools.motionFrame(item.frame), tools, signals));
            BreakConditions.addTriggers(motion, item.triggers, tools.motionFrame(item.frame), tools, signals, listener);
            adopt(tools.motionFrame(item.frame).moveAsync(motion, job), job);
        } catch (RuntimeException e) {
            log.warn("a motion was refused by the cabinet: " + e);
            job.fail(e.getMessage());
        }
        return job;
    }

    public MotionJob start(Item[] batch, Mode mode, MotionJob.Listener[] listeners) throws CommandRejected {
        RobotMotion<?>[] members = builder.motions(batch);
        SunriseBatch job = new SunriseBatch(members, listeners);
        try {
            RobotMotion<?> whole = builder.batch(members, mode);
            job.breakWhen(whole, BreakConditions.of(batch[0].until, tools.motionFrame(batch[0].frame), tools, signals));
            for (int i = 0; i < batch.length; i++) {
                BreakConditions.addTriggers(members[i], batch[i].triggers, tools.motionFrame(batch[i].frame), tools, signals, listeners[i]);
            }
            adopt(tools.motionFrame(batch[0].frame).moveAsync(whole, job), job);
        } catch (RuntimeException e) {
            log.warn("a batch was refused by the cabinet: " + e);
            job.fail(e.getMessage());
        }
        return job;
    }

    public void check(ServoOpen open) throws CommandRejected {
        builder.check(open);
    }

    public ServoJob openServo(ServoOpen open, MotionJob.Listener listener) throws CommandRejected {
        SunriseJob job = new SunriseJob(listener);
        try {
            SunriseServo servo = SunriseServo.of(open, lbr, tools, modes, job);
            adopt(servo.start(), job);
            return servo;
        } catch (LinkageError e) {
            throw new CommandRejected(Code.UNSUPPORTED, "Sunrise.Servoing is not installed on this cabinet (" + e + "); install that option");
        } catch (RuntimeException e) {
            log.warn("a servo motion was refused by the cabinet: " + e);
            throw new CommandRejected(Code.EXECUTION_FAILED, String.valueOf(e.getMessage()));
        }
    }

    public void check(FriOpen open) throws CommandRejected {
        modes.check(open.mode, tools.motionFrame(), "mode.");
        try {
            SunriseFri.check(open);
        } catch (LinkageError e) {
            throw new CommandRejected(Code.UNSUPPORTED, "Sunrise.FRI is not installed on this cabinet (" + e + "); install that option");
        }
    }

    public FriSession openFri(FriOpen open, FriSession.Listener listener) throws CommandRejected {
        try {
            return SunriseFri.of(open, lbr, modes, signals, new SunriseFri.Mover() {
                public MotionJob move(PositionHold hold, MotionJob.Listener jobListener) throws CommandRejected {
                    return startPlain(hold, "", jobListener);
                }
            }, listener);
        } catch (LinkageError e) {
            throw new CommandRejected(Code.UNSUPPORTED, "Sunrise.FRI is not installed on this cabinet (" + e + "); install that option");
        } catch (RuntimeException e) {
            log.warn("an FRI session was refused by the cabinet: " + e);
            throw new CommandRejected(Code.EXECUTION_FAILED, String.valueOf(e.getMessage()));
        }
    }

    private MotionJob startPlain(IMotion motion, String frame, MotionJob.Listener listener) throws CommandRejected {
        SunriseJob job = new SunriseJob(listener);
        try {
            adopt(tools.motionFrame(frame).moveAsync(motion, job), job);
        } catch (RuntimeException e) {
            log.warn("a motion was refused by the cabinet: " + e);
            job.fail(e.getMessage());
        }
        return job;
    }

    private void adopt(IMotionContainer container, SunriseJob job) {
        String failure;
        synchronized (jobs) {
            jobs.put(container, job);
            failure = orphans.remove(container);
            forgetFinished();
        }
        job.set(container);
        if (failure != null) {
            job.fail(failure);
        }
    }

    /** Forget finished containers; under the lock of jobs. */
    private void forgetFinished() {
        Iterator<IMotionContainer> all = jobs.keySet().iterator();
        while (all.hasNext()) {
            if (all.next().isFinished()) {
                all.remove();
            }
        }
    }

    /** Receives a failed motion from Sunrise; the error becomes an event, and the application continues. */
    public ErrorHandlingAction handleError(Device device, IMotionContainer failed, List<IMotionContainer> cancelled) {
        String text = failed.getErrorMessage();
        SunriseJob job;
        synchronized (jobs) {
            job = jobs.remove(failed);
            if (job == null) {
                orphans.put(failed, String.valueOf(text));
            }
        }
        if (job != null) {
            job.fail(text);
        }
        for (IMotionContainer one : cancelled) {
            SunriseJob following;
            synchronized (jobs) {
                following = jobs.get(one);
            }
            if (following != null) {
                following.cancel();
            }
        }
        return ErrorHandlingAction.Ignore;
    }

    public void stop() {
        execution.cancelAll();
    }

    /** A cabinet offers applications one kind of braking; only a simulated one has a faster kind. */
    public void stopFast() {
        if (probe != null) {
            probe.stopFast();
        } else {
            stop();
        }
    }

    public void pause() {
        execution.startPause();
    }

    public void resume() {
        execution.resumeExecution(ResumeMode.OnPath);
    }

    public void setOverride(double value) {
        control.setApplicationOverride(value);
    }

    public double override() {
        return control.getApplicationOverride();
    }
}
