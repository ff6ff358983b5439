package heptarm.app;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.IdentityHashMap;
import java.util.Iterator;
import java.util.List;
import java.util.Map;
import java.util.ServiceLoader;

import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.controllerModel.recovery.IRecovery;
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

import heptarm.core.Fri;
import heptarm.core.Insight;
import heptarm.core.Job;
import heptarm.core.Log;
import heptarm.core.Models;
import heptarm.core.Refusal;
import heptarm.core.Robot;
import heptarm.core.Servo;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.FrameInfo;
import heptarm.wire.FriOpen;
import heptarm.wire.HandGuide;
import heptarm.wire.Item;
import heptarm.wire.Mode;
import heptarm.wire.PoseState;
import heptarm.wire.RobotInfo;
import heptarm.wire.SafetyState;
import heptarm.wire.ServoOpen;
import heptarm.wire.SetKey;
import heptarm.wire.SignalInfo;
import heptarm.wire.ToolInfo;
import heptarm.wire.WrenchState;

/** The robot of the cabinet behind the core's seam. */
final class SunriseRobot implements Robot, IErrorHandler {
    private final LBR lbr;
    private final Tools tools;
    private final SunriseExecutionService execution;
    private final IApplicationControl control;
    private final Log log;
    private final Motions motions;
    private final RobotInfo info;
    private final Insight insight;
    private final Readings readings;
    private CabinetPanel panel = new CabinetPanel(null, null);
    private final SunriseSafety safety;
    private final Map<IMotionContainer, SunriseJob> jobs = new IdentityHashMap<IMotionContainer, SunriseJob>();
    private final Map<IMotionContainer, String> orphans = new IdentityHashMap<IMotionContainer, String>();

    SunriseRobot(LBR lbr, Tools tools, IApplicationControl control, Log log) {
        this.lbr = lbr;
        this.tools = tools;
        this.execution = (SunriseExecutionService) lbr.getController().getExecutionService();
        this.control = control;
        this.log = log;
        this.motions = new Motions(lbr, tools);
        this.info = Models.describe(lbr.getName(), lbr.getJointLimits().getMinJointPosition().get(),
                lbr.getJointLimits().getMaxJointPosition().get());
        Iterator<Insight> found = ServiceLoader.load(Insight.class, Insight.class.getClassLoader()).iterator();
        this.insight = found.hasNext() ? found.next() : null;
        this.readings = new Readings(lbr, tools, insight);
        this.safety = new SunriseSafety(lbr, execution, insight);
        control.registerMoveAsyncErrorHandler(this);
    }

    /** From now on the safety state tells whether the application has to be recovered first. */
    void heed(IRecovery recovery) {
        safety.heed(recovery);
    }

    /** From now on there are signals, keys and process data. */
    void furnish(CabinetPanel furnished) {
        panel = furnished;
    }

    CabinetPanel panel() {
        return panel;
    }

    public RobotInfo info() {
        return info;
    }

    public String cabinet() {
        return lbr.getController().getName();
    }

    public boolean isVirtual() {
        return insight != null;
    }

    public String[] capabilities() {
        List<String> all = new ArrayList<String>(Arrays.asList(Motions.CAPABILITIES));
        try {
            all.add(SunriseLin.capability());
        } catch (LinkageError e) {
            log.info("this cabinet has no straight servo motions: " + e);
        }
        try {
            all.addAll(Arrays.asList(SunriseFri.capabilities()));
        } catch (LinkageError e) {
            log.info("this cabinet has no FRI: " + e);
        }
        try {
            all.add(SunriseGuiding.capability());
        } catch (LinkageError e) {
            log.info("this cabinet has no hand guiding: " + e);
        }
        return all.toArray(new String[0]);
    }

    public ToolInfo[] tools() {
        return tools.templates();
    }

    public ToolInfo template(String name) {
        return tools.template(name);
    }

    public void attach(ToolInfo tool, String moved) throws Refusal {
        tools.attach(tool, moved);
    }

    public void load(ToolInfo workpiece) throws Refusal {
        tools.load(workpiece);
    }

    public FrameInfo[] frames() {
        return tools.taught();
    }

    public SignalInfo[] signals() {
        return panel.signals == null ? new SignalInfo[0] : panel.signals.infos();
    }

    public void readJoints(double[] q, double[] commanded) {
        readings.joints(q, commanded);
    }

    public void readTorques(double[] measured, double[] external, double[] commanded) {
        readings.torques(measured, external, commanded);
    }

    public PoseState readPose(long stamp) {
        return readings.pose(stamp);
    }

    public WrenchState readWrench(long stamp) {
        return readings.wrench(stamp);
    }

    public WrenchState readWrench(String axes, long stamp) {
        return readings.wrench(axes, stamp);
    }

    public void readProgress(double[] progressAndRemaining) {
        readings.progress(progressAndRemaining);
    }

    public void readSignals(double[] values, int from, int count) {
        panel.signals.read(values, from, count);
    }

    public void writeSignals(int[] places, double[] values) throws Refusal {
        panel.signals.write(places, values);
    }

    public void setKey(SetKey key) throws Refusal {
        panel.setKey(key);
    }

    public String processData(String name) throws Refusal {
        return panel.processData(name);
    }

    public void setProcessData(String name, String value) throws Refusal {
        panel.setProcessData(name, value);
    }

    public boolean watches(Condition condition) {
        return BreakConditions.can(condition);
    }

    public SafetyState readSafety(long stamp) {
        return safety.read(stamp);
    }

    public void check(Item item, String path) throws Refusal {
        motions.check(item, path);
        if (item.motion instanceof HandGuide) {
            try {
                SunriseGuiding.of((HandGuide) item.motion, lbr);
            } catch (LinkageError e) {
                throw new Refusal(Code.UNSUPPORTED, path + "motion", "HandGuide", "", "this cabinet lacks hand guiding (" + e + ")");
            }
        }
    }

    public Job start(Item item, Mode mode, Job.Listener listener) throws Refusal {
        if (item.motion instanceof HandGuide) {
            return begin(SunriseGuiding.of((HandGuide) item.motion, lbr), item.frame, listener);
        }
        SunriseJob job = new SunriseJob(listener);
        try {
            RobotMotion<?> motion = motions.motion(item, mode, job.segments);
            job.guard(motion, BreakConditions.of(item.until, tools.moved(item.frame), tools, panel.signals));
            BreakConditions.trigger(motion, item.triggers, tools.moved(item.frame), tools, panel.signals, listener);
            adopt(tools.moved(item.frame).moveAsync(motion, job), job);
        } catch (RuntimeException e) {
            log.warn("a motion was refused by the cabinet: " + e);
            job.fail(e.getMessage());
        }
        return job;
    }

    public Job start(Item[] batch, Mode mode, Job.Listener[] listeners) throws Refusal {
        RobotMotion<?>[] members = motions.motions(batch);
        SunriseBatch job = new SunriseBatch(members, listeners);
        try {
            RobotMotion<?> whole = motions.batch(members, mode);
            job.guard(whole, BreakConditions.of(batch[0].until, tools.moved(batch[0].frame), tools, panel.signals));
            for (int i = 0; i < batch.length; i++) {
                BreakConditions.trigger(members[i], batch[i].triggers, tools.moved(batch[i].frame), tools, panel.signals, listeners[i]);
            }
            adopt(tools.moved(batch[0].frame).moveAsync(whole, job), job);
        } catch (RuntimeException e) {
            log.warn("a batch was refused by the cabinet: " + e);
            job.fail(e.getMessage());
        }
        return job;
    }

    public void check(ServoOpen open) throws Refusal {
        motions.check(open);
    }

    public Servo servo(ServoOpen open, Job.Listener listener) throws Refusal {
        SunriseJob job = new SunriseJob(listener);
        try {
            SunriseServo servo = SunriseServo.of(open, lbr, tools, job);
            adopt(servo.start(), job);
            return servo;
        } catch (LinkageError e) {
            throw new Refusal(Code.UNSUPPORTED, "this cabinet lacks the option Sunrise.Servoing (" + e + ")");
        } catch (RuntimeException e) {
            log.warn("a servo motion was refused by the cabinet: " + e);
            throw new Refusal(Code.EXECUTION_FAILED, String.valueOf(e.getMessage()));
        }
    }

    public void check(FriOpen open) throws Refusal {
        new Modes(tools).check(open.mode, tools.moved(), "mode.");
        try {
            SunriseFri.check(open);
        } catch (LinkageError e) {
            throw new Refusal(Code.UNSUPPORTED, "this cabinet lacks the option Sunrise.FRI (" + e + ")");
        }
    }

    public Fri fri(FriOpen open, Fri.Listener listener) throws Refusal {
        try {
            return SunriseFri.of(open, lbr, new Modes(tools), panel.signals, new SunriseFri.Mover() {
                public Job move(PositionHold hold, Job.Listener jobListener) throws Refusal {
                    return begin(hold, "", jobListener);
                }
            }, listener);
        } catch (LinkageError e) {
            throw new Refusal(Code.UNSUPPORTED, "this cabinet lacks the option Sunrise.FRI (" + e + ")");
        } catch (RuntimeException e) {
            log.warn("an FRI session was refused by the cabinet: " + e);
            throw new Refusal(Code.EXECUTION_FAILED, String.valueOf(e.getMessage()));
        }
    }

    private Job begin(IMotion motion, String frame, Job.Listener listener) throws Refusal {
        SunriseJob job = new SunriseJob(listener);
        try {
            adopt(tools.moved(frame).moveAsync(motion, job), job);
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

    /** Under the lock of jobs. */
    private void forgetFinished() {
        Iterator<IMotionContainer> all = jobs.keySet().iterator();
        while (all.hasNext()) {
            if (all.next().isFinished()) {
                all.remove();
            }
        }
    }

    /** Sunrise tells of a failed motion here; the error becomes an event, the application goes on. */
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
            SunriseJob behind;
            synchronized (jobs) {
                behind = jobs.get(one);
            }
            if (behind != null) {
                behind.cancel();
            }
        }
        return ErrorHandlingAction.Ignore;
    }

    public void stop() {
        execution.cancelAll();
    }

    /** A cabinet offers applications one kind of braking; only a simulated one has another. */
    public void stopFast() {
        if (insight != null) {
            insight.stopFast();
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

    public void recover() throws Refusal {
        safety.recover();
    }

    public void show(int severity, String text) {
        if (severity == 0) {
            log.info(text);
        } else {
            log.warn(text);
        }
    }
}
