package heptarm.core.api;

import java.util.HashMap;
import java.util.Map;

import heptarm.core.Clock;
import heptarm.core.Clocks;
import heptarm.core.CommandRejected;
import heptarm.core.EventBus;
import heptarm.core.Log;
import heptarm.core.robot.Robot;
import heptarm.core.session.RobotService;
import heptarm.core.state.SignalTable;
import heptarm.wire.AttachLoad;
import heptarm.wire.AttachTool;
import heptarm.wire.Cancel;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.DefineTool;
import heptarm.wire.FrameInfo;
import heptarm.wire.Item;
import heptarm.wire.Message;
import heptarm.wire.Mode;
import heptarm.wire.MotionFinished;
import heptarm.wire.Pause;
import heptarm.wire.PoseState;
import heptarm.wire.Recover;
import heptarm.wire.Resume;
import heptarm.wire.RobotInfo;
import heptarm.wire.Run;
import heptarm.wire.SafetyState;
import heptarm.wire.ServoClose;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;
import heptarm.wire.ServoTiming;
import heptarm.wire.ServoSettings;
import heptarm.wire.SetOverride;
import heptarm.wire.SetSignal;
import heptarm.wire.SetSignals;
import heptarm.wire.SignalInfo;
import heptarm.wire.Shape;
import heptarm.wire.Stop;
import heptarm.wire.StopKind;
import heptarm.wire.ToolInfo;
import heptarm.wire.TorqueState;
import heptarm.wire.When;
import heptarm.wire.WrenchState;

/**
 * The robot for programs in the cabinet itself: the same checks, motions and results as for clients, without a network.
 *
 * <p>Any thread may call all methods. While a client controls the robot over the network, only a stop is accepted here.
 */
public final class Arm implements EventBus.Listener {
    private static final double NAN = Double.NaN;
    private static final CartesianDynamics UNBOUNDED = new CartesianDynamics(NAN, NAN, NAN, NAN, NAN, NAN);
    private static final Condition NEVER = new Condition(new ConditionNode[0]);
    private static final ServoTiming TIMING = new ServoTiming(0.02, 300.0, 0.1);

    private final RobotService service;
    private final boolean isOwner;
    private final Map<Long, MotionHandle> handles = new HashMap<Long, MotionHandle>();

    /** Shares a running service, for example with the clients of a server. */
    public Arm(RobotService service) {
        this(service, false);
    }

    private Arm(RobotService service, boolean isOwner) {
        this.service = service;
        this.isOwner = isOwner;
        service.events.add(this);
    }

    /** An arm without any network. */
    public static Arm alone(Robot robot, Log log) {
        RobotService service = new RobotService(robot, Clocks.find(), log);
        service.start();
        return new Arm(service, true);
    }

    /** Release the robot; an arm without network stops it and ends its threads. */
    public void close() {
        service.events.remove(this);
        if (isOwner) {
            service.close();
        }
    }

    Clock clock() {
        return service.clock;
    }

    // --------------------------------------------------------------------------------------------- motions

    /** Execute motions one after the other; returns when they have ended, or a stop has ended them. */
    public MotionFinished move(Move... moves) throws CommandRejected, InterruptedException {
        MotionFinished end = start(moves).await();
        if (end.cause == Cause.FAILED || end.cause == Cause.SAFETY) {
            throw new CommandRejected(end.code, end.text);
        }
        return end;
    }

    /** Start motions after those that are running or waiting; returns at once. */
    public MotionHandle start(Move... moves) throws CommandRejected {
        return start(When.QUEUE, moves);
    }

    /** Start motions; {@code when} selects what happens while another one is running. */
    public MotionHandle start(When when, Move... moves) throws CommandRejected {
        Item[] items = new Item[moves.length];
        for (int i = 0; i < moves.length; i++) {
            items[i] = moves[i].item();
        }
        return begin(new Run(items, when));
    }

    /**
     * Open a stream of targets that the arm follows.
     *
     * @param speed limit, a fraction of each axis' maximum
     * @param acceleration limit, a fraction of each axis' maximum
     * @param watchdog time after a target within which the next must arrive, or the arm brakes [s]
     * @param mode control mode; null: position control
     */
    public ServoHandle servo(double speed, double acceleration, double watchdog, Mode mode) throws CommandRejected {
        return servo(new ServoOpen(ServoEngine.SMART, "", mode, speed, acceleration, UNBOUNDED, TIMING, watchdog, NEVER));
    }

    /**
     * Open a stream of poses that the motion frame follows on straight lines.
     *
     * @param limits limits along and about each axis of the base; NaN: the cabinet's default; the jerk must be NaN
     * @param watchdog time after a target within which the next must arrive, or the arm brakes [s]
     * @param mode control mode; null: position control
     */
    public ServoHandle servoLin(CartesianDynamics limits, double watchdog, Mode mode) throws CommandRejected {
        return servo(new ServoOpen(ServoEngine.LIN, "", mode, 1.0, 1.0, limits, TIMING, watchdog, NEVER));
    }

    /** Open a servo motion with all its parameters. */
    public ServoHandle servo(ServoOpen open) throws CommandRejected {
        return new ServoHandle(this, begin(open), open.watchdog);
    }

    private MotionHandle begin(Message request) throws CommandRejected {
        synchronized (handles) { // its end must not be reported before it is listed
            long id = command(request);
            MotionHandle handle = new MotionHandle(this, id);
            handles.put(id, handle);
            return handle;
        }
    }

    /** Brake on the path and drop waiting motions. */
    public void stop() {
        service.stop("stopped by the program in the cabinet");
    }

    /** Drop waiting motions; the running one ends normally. */
    public void stopAfterMotion() throws CommandRejected {
        command(new Stop(StopKind.AFTER_MOTION));
    }

    public void pause() throws CommandRejected {
        command(new Pause());
    }

    public void resume() throws CommandRejected {
        command(new Resume());
    }

    /** Set the factor on every programmed speed, in [0, 1]. */
    public void setOverride(double value) throws CommandRejected {
        command(new SetOverride(value));
    }

    /** Do what software may do to make the robot ready; otherwise refuses with the operator's steps. */
    public void recover() throws CommandRejected {
        command(new Recover());
    }

    void cancel(long id) throws CommandRejected {
        command(new Cancel(id));
    }

    void closeServo(long servo) throws CommandRejected {
        command(new ServoClose(servo));
    }

    void changeMode(long servo, Mode mode) throws CommandRejected {
        command(new ServoSettings(servo, mode));
    }

    void follow(Message target) throws CommandRejected {
        service.commands.follow(target, service.clock.nanos());
    }

    private long command(Message request) throws CommandRejected {
        String controller = service.authority.name();
        if (controller.length() > 0) {
            throw new CommandRejected(Code.NOT_IN_CONTROL, "controller", controller, "",
                    controller + " controls the robot over the network; wait until it releases control");
        }
        return service.commands.execute(request);
    }

    public void received(Message event) {
        if (event instanceof MotionFinished) {
            MotionHandle handle;
            synchronized (handles) {
                handle = handles.remove(((MotionFinished) event).id);
            }
            if (handle != null) {
                handle.end((MotionFinished) event);
            }
        }
    }

    // ------------------------------------------------------------------------------------- tools and signals

    /** Tools that can be attached by name: templates of the project whose names are known, and defined tools. */
    public ToolInfo[] tools() {
        return service.tools.known();
    }

    /** Define a tool, or replace its definition. */
    public void define(ToolInfo tool) throws CommandRejected {
        command(new DefineTool(tool));
    }

    /** Attach a defined tool, or a template of the project, to the flange; motions move its first frame. */
    public void attach(String tool) throws CommandRejected {
        attach(tool, "");
    }

    /** Attach a tool; motions move the named frame of it. */
    public void attach(String tool, String frame) throws CommandRejected {
        command(new AttachTool(tool, frame));
    }

    /** Detach the tool and its workpiece. */
    public void detach() throws CommandRejected {
        command(new AttachTool("", ""));
    }

    /** Attach a workpiece to the motion frame. */
    public void load(ToolInfo workpiece) throws CommandRejected {
        command(new AttachLoad(workpiece, true, false, false));
    }

    /** Attach a workpiece to the motion frame, as the safety workpiece: the safety functions of the cabinet count its load, too. */
    public void loadAsSafety(ToolInfo workpiece) throws CommandRejected {
        command(new AttachLoad(workpiece, true, false, true));
    }

    /** Attach the workpiece of a template of the project to the motion frame. */
    public void load(String template) throws CommandRejected {
        command(new AttachLoad(named(template), true, true, false));
    }

    /** Attach the workpiece of a template of the project to the motion frame, as the safety workpiece. */
    public void loadAsSafety(String template) throws CommandRejected {
        command(new AttachLoad(named(template), true, true, true));
    }

    /** Detach a workpiece. */
    public void unload(ToolInfo workpiece) throws CommandRejected {
        unload(workpiece.name);
    }

    /** Detach a workpiece by its name. */
    public void unload(String workpiece) throws CommandRejected {
        command(new AttachLoad(named(workpiece), false, false, false));
    }

    private static ToolInfo named(String workpiece) {
        return new ToolInfo(workpiece, 0.0, new double[3], new double[6], new FrameInfo[0], new Shape[0]);
    }

    /** Names of the attached tool, of the workpiece (empty: none), of the motion frame, and of the safety workpiece (empty: none). */
    public String[] attached() {
        return service.tools.attached();
    }

    /** Signals of the cabinet's IO groups, each named "group.name". */
    public SignalInfo[] signals() {
        return service.robot.signals.signals();
    }

    /** Value of a signal; 0 or 1 for a boolean one. */
    public double read(String signal) throws CommandRejected {
        SignalInfo[] all = service.robot.signals.signals();
        int index = SignalTable.index(signal, all, "signal");
        double[] values = new double[all.length];
        service.robot.signals.read(values, index, 1);
        return values[index];
    }

    /** Write an output; 0 or 1 for a boolean one. */
    public void write(String signal, double value) throws CommandRejected {
        command(new SetSignals(new SetSignal[] {new SetSignal(signal, value)}));
    }

    // ----------------------------------------------------------------------------------------------- state

    public RobotInfo info() {
        return service.robot.info;
    }

    /** Names of the supported motions, control modes and functions. */
    public String[] capabilities() {
        return service.robot.capabilities.clone();
    }

    public double override() {
        return service.robot.motion.override();
    }

    /** Control mode of the running motion with its parameters; HandGuidingMode while the arm is guided by hand, position control while none is running. */
    public Mode mode() {
        return service.executor.status().mode;
    }

    /** Measured joint positions [rad]. */
    public double[] joints() {
        return service.reader.joints().q;
    }

    /** Torques [Nm]. */
    public TorqueState torques() {
        return service.reader.torques();
    }

    /** Pose of the motion frame in the base, measured and commanded. */
    public PoseState pose() {
        return service.reader.pose();
    }

    /** External wrench at the motion frame, in the axes of the base. */
    public WrenchState wrench() {
        return service.reader.wrench();
    }

    /** External wrench in the axes of another frame: "" (the motion frame), "flange", or a frame's name. */
    public WrenchState wrench(String axes) throws CommandRejected {
        service.tools.checkReference(axes, "axes");
        return service.reader.wrench(axes);
    }

    public SafetyState safety() {
        return service.safety.read();
    }
}
