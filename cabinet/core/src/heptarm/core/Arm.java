package heptarm.core;

import java.util.HashMap;
import java.util.Map;

import heptarm.wire.Cancel;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.Cause;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.Item;
import heptarm.wire.Message;
import heptarm.wire.Mode;
import heptarm.wire.MotionFinished;
import heptarm.wire.Pause;
import heptarm.wire.PoseState;
import heptarm.wire.Recover;
import heptarm.wire.Resume;
import heptarm.wire.Run;
import heptarm.wire.SafetyState;
import heptarm.wire.ServoClose;
import heptarm.wire.ServoEngine;
import heptarm.wire.ServoOpen;
import heptarm.wire.SetOverride;
import heptarm.wire.Stop;
import heptarm.wire.StopKind;
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
        return servo(new ServoOpen(ServoEngine.SMART, "", mode, speed, acceleration, UNBOUNDED, SHORTEST, PATIENCE, watchdog, NEVER));
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

    // ----------------------------------------------------------------------------------------------- state

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

    /** Of the flange in the base, measured and commanded. */
    public PoseState pose() {
        return server.robot.readPose(server.clock.nanos());
    }

    /** External, at the flange, in the axes of the base. */
    public WrenchState wrench() {
        return server.robot.readWrench(server.clock.nanos());
    }

    public SafetyState safety() {
        return server.robot.readSafety(server.clock.nanos());
    }
}
