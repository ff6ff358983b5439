package heptarm.core;

import java.util.HashMap;
import java.util.Map;

import heptarm.wire.AttachLoad;
import heptarm.wire.AttachTool;
import heptarm.wire.Cancel;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.DefineTool;
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
import heptarm.wire.ServoSettings;
import heptarm.wire.SetOverride;
import heptarm.wire.SetSignal;
import heptarm.wire.SetSignals;
import heptarm.wire.SignalInfo;
import heptarm.wire.Stop;
import heptarm.wire.StopKind;
import heptarm.wire.ToolInfo;
import heptarm.wire.TorqueState;
import heptarm.wire.When;
import heptarm.wire.WrenchState;

/**
 * The robot for programs in the cabinet itself: the same checks, motions and results as for clients, without a network.
 *
 * <p>All methods may be called from any thread. While a client controls the robot over the network, nothing but a stop is
 * taken from here.
 */
public final class Arm implements Server.Hearer {
    private static final double NAN = Double.NaN;
    private static final CartesianDynamics UNBOUNDED = new CartesianDynamics(NAN, NAN, NAN, NAN, NAN, NAN);
    private static final Condition NEVER = new Condition(new ConditionNode[0]);
    /** Time that a servo target is reached in at least, and without a target before the servo motion ends [s]. */
    private static final double SHORTEST = 0.02;
    private static final double PATIENCE = 300.0;
    /** How long the velocity of a target is kept after the target was passed [s]. */
    private static final double KEPT = 0.1;

    private final Server server;
    private final boolean isOwn;
    private final Map<Long, Handle> handles = new HashMap<Long, Handle>();

    /** Beside the clients of a server. */
    public Arm(Server server) {
        this(server, false);
    }

    private Arm(Server server, boolean isOwn) {
        this.server = server;
        this.isOwn = isOwn;
        server.listen(this);
    }

    /** Without any network. */
    public static Arm alone(Robot robot, Log log) {
        Server server = new Server(robot, new Config("", 0, "", "", 0.5, 200.0), Clocks.find(), log);
        server.begin();
        return new Arm(server, true);
    }

    /** Stops whatever moves, and ends the threads. */
    public void close() {
        server.forget(this);
        if (isOwn) {
            server.close();
        }
    }

    // --------------------------------------------------------------------------------------------- motions

    /** Carries out motions, one behind the other, and returns when they have ended or a stop has ended them. */
    public MotionFinished move(Move... moves) throws Refusal, InterruptedException {
        MotionFinished end = start(moves).await();
        if (end.cause == Cause.FAILED || end.cause == Cause.SAFETY) {
            throw new Refusal(end.code, end.text);
        }
        return end;
    }

    /** Starts motions behind those that run or wait, and returns at once. */
    public Handle start(Move... moves) throws Refusal {
        return start(When.QUEUE, moves);
    }

    public Handle start(When when, Move... moves) throws Refusal {
        Item[] items = new Item[moves.length];
        for (int i = 0; i < moves.length; i++) {
            items[i] = moves[i].item();
        }
        return begin(new Run(items, when));
    }

    /**
     * Opens a stream of targets that the arm follows.
     *
     * @param speed ceiling, a fraction of each axis' maximum
     * @param acceleration likewise
     * @param watchdog within this time after a target the next one has to come, or the arm brakes [s]
     * @param mode control mode; null: position control
     */
    public Steering servo(double speed, double acceleration, double watchdog, Mode mode) throws Refusal {
        return servo(new ServoOpen(ServoEngine.SMART, "", mode, speed, acceleration, UNBOUNDED, SHORTEST, PATIENCE, KEPT, watchdog, NEVER));
    }

    /**
     * Opens a stream of poses that the moved frame follows on straight lines.
     *
     * @param most limits along and about each axis of the base; NaN: as the cabinet has it; there are none of the jerk
     * @param watchdog see {@link #servo(double, double, double, Mode)}
     * @param mode likewise
     */
    public Steering servoLin(CartesianDynamics most, double watchdog, Mode mode) throws Refusal {
        return servo(new ServoOpen(ServoEngine.LIN, "", mode, 1.0, 1.0, most, SHORTEST, PATIENCE, KEPT, watchdog, NEVER));
    }

    /** The same with everything that can be said. */
    public Steering servo(ServoOpen open) throws Refusal {
        return new Steering(this, begin(open), open.watchdog);
    }

    private Handle begin(Message order) throws Refusal {
        synchronized (handles) { // so that its end is not told before it is known
            long id = command(order);
            Handle handle = new Handle(this, id);
            handles.put(id, handle);
            return handle;
        }
    }

    public void stop() {
        server.stop("the program in the cabinet stopped it");
    }

    /** Drops what waits; what runs runs to its end. */
    public void stopAfterMotion() throws Refusal {
        command(new Stop(StopKind.AFTER_MOTION));
    }

    public void pause() throws Refusal {
        command(new Pause());
    }

    public void resume() throws Refusal {
        command(new Resume());
    }

    /** Factor on every programmed speed, 0 to 1. */
    public void setOverride(double value) throws Refusal {
        command(new SetOverride(value));
    }

    /** Does what software may do to make the robot ready; refuses with the operator's steps otherwise. */
    public void recover() throws Refusal {
        command(new Recover());
    }

    void cancel(long id) throws Refusal {
        command(new Cancel(id));
    }

    void close(long servo) throws Refusal {
        command(new ServoClose(servo));
    }

    void change(long servo, Mode mode) throws Refusal {
        command(new ServoSettings(servo, mode));
    }

    void follow(Message target) throws Refusal {
        server.dispatcher.follow(target, server.clock.nanos());
    }

    private long command(Message order) throws Refusal {
        String holder = server.authority.name();
        if (holder.length() > 0) {
            throw new Refusal(Code.NOT_IN_CONTROL, "controller", holder, "", holder + " controls the robot over the network");
        }
        return server.dispatcher.order(order);
    }

    public void heard(Message event) {
        if (event instanceof MotionFinished) {
            Handle handle;
            synchronized (handles) {
                handle = handles.remove(((MotionFinished) event).id);
            }
            if (handle != null) {
                handle.end((MotionFinished) event);
            }
        }
    }

    // ------------------------------------------------------------------------------------- tools and signals

    /** Tools that can be attached by name: templates of the project as far as their names are known, and defined ones. */
    public ToolInfo[] tools() {
        return server.rack.known();
    }

    /** Makes a tool known, or says otherwise what one is. */
    public void define(ToolInfo tool) throws Refusal {
        command(new DefineTool(tool));
    }

    /** A defined tool, or a template of the project, hangs on the flange from now on; motions move its first frame. */
    public void attach(String tool) throws Refusal {
        attach(tool, "");
    }

    /** The same; motions move one of its frames. */
    public void attach(String tool, String frame) throws Refusal {
        command(new AttachTool(tool, frame));
    }

    /** Nothing hangs on the flange any more; a workpiece goes with its tool. */
    public void detach() throws Refusal {
        command(new AttachTool("", ""));
    }

    /** The tool holds a workpiece, in the frame that motions move. */
    public void load(ToolInfo workpiece) throws Refusal {
        command(new AttachLoad(workpiece, true));
    }

    /** It does not hold it any more. */
    public void unload(ToolInfo workpiece) throws Refusal {
        command(new AttachLoad(workpiece, false));
    }

    /** Names of the attached tool, of the workpiece (empty: none), and of the frame that motions move. */
    public String[] fitted() {
        return server.rack.fitted();
    }

    /** Signals of the cabinet's IO groups, each named "group.name". */
    public SignalInfo[] signals() {
        return server.robot.signals();
    }

    /** Value of a signal; of a boolean one 0 or 1. */
    public double read(String signal) throws Refusal {
        SignalInfo[] all = server.robot.signals();
        int place = Signals.of(signal, all, "signal");
        double[] values = new double[all.length];
        server.robot.readSignals(values, place, 1);
        return values[place];
    }

    /** Writes an output; of a boolean one 0 or 1. */
    public void write(String signal, double value) throws Refusal {
        command(new SetSignals(new SetSignal[] {new SetSignal(signal, value)}));
    }

    // ----------------------------------------------------------------------------------------------- state

    public RobotInfo info() {
        return server.robot.info();
    }

    /** What can be asked for: names of motions, modes and functions. */
    public String[] capabilities() {
        return server.robot.capabilities();
    }

    public double override() {
        return server.robot.override();
    }

    /** Control mode of what runs, with its parameters; position control while nothing does. */
    public Mode mode() {
        return server.executor.mode();
    }

    /** Measured joint positions [rad]. */
    public double[] joints() {
        double[] q = new double[7];
        server.robot.readJoints(q, new double[7]);
        return q;
    }

    /** Torques [Nm]. */
    public TorqueState torques() {
        double[] measured = new double[7];
        double[] external = new double[7];
        double[] commanded = new double[7];
        server.robot.readTorques(measured, external, commanded);
        return new TorqueState(server.clock.nanos(), measured, external, commanded);
    }

    /** Of the moved frame in the base, measured and commanded. */
    public PoseState pose() {
        return server.robot.readPose(server.clock.nanos());
    }

    /** External, at the moved frame, in the axes of the base. */
    public WrenchState wrench() {
        return server.robot.readWrench(server.clock.nanos());
    }

    /** The same in the axes of another frame: "" (the moved frame), "flange", or a frame's name. */
    public WrenchState wrench(String axes) throws Refusal {
        server.rack.checkReference(axes, "axes");
        return server.robot.readWrench(axes, server.clock.nanos());
    }

    public SafetyState safety() {
        return server.robot.readSafety(server.clock.nanos());
    }
}
