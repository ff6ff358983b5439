package heptarm.core;

import heptarm.wire.Condition;
import heptarm.wire.FrameInfo;
import heptarm.wire.FriOpen;
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

/**
 * A robot as the core sees it, in SI. The application implements it on the cabinet's API; tests may do without a cabinet.
 *
 * <p>Reading methods are called by the threads of the sampler, the motions and the watchdog and may take their time,
 * {@link #start} by the motion thread, all others by any thread.
 */
public interface Robot {
    RobotInfo info();

    /** Name of the cabinet, for people. */
    String cabinet();

    /** Whether the robot is simulated. */
    boolean isVirtual();

    /** What can be asked for: names of motions, modes and functions. */
    String[] capabilities();

    /** Templates of the project, as far as the robot knows their names. */
    ToolInfo[] tools();

    FrameInfo[] frames();

    SignalInfo[] signals();

    /** The tool that a template of the project describes; null if there is no such template. */
    ToolInfo template(String name);

    /** Attaches a tool in place of another, null: none, and takes a workpiece off; from now on motions move that frame. */
    void attach(ToolInfo tool, String moved) throws Refusal;

    /** Attaches a workpiece to the moved frame; null: takes it off. */
    void load(ToolInfo workpiece) throws Refusal;

    /** Measured and commanded joint positions [rad]. */
    void readJoints(double[] q, double[] commanded);

    /** Measured, external and commanded torques [Nm]; NaN where the robot does not tell. */
    void readTorques(double[] measured, double[] external, double[] commanded);

    PoseState readPose(long stamp);

    WrenchState readWrench(long stamp);

    /** The same at the moved frame in the axes of another one: "" or "tool" (the moved frame's own), "flange", "base" or a name. */
    WrenchState readWrench(String axes, long stamp);

    /** Reads some of the signals, into their places. */
    void readSignals(double[] values, int from, int count);

    /** Writes outputs that were checked. */
    void writeSignals(int[] places, double[] values) throws Refusal;

    /** Text and lamp of a user key for clients. */
    void setKey(SetKey key) throws Refusal;

    /** A value of the process data as text. */
    String processData(String name) throws Refusal;

    /** Changes a value of the process data; the text has to be one of its type. */
    void setProcessData(String name, String value) throws Refusal;

    /** Whether the robot itself watches a break condition while a motion runs; otherwise the core does. */
    boolean watches(Condition condition);

    SafetyState readSafety(long stamp);

    /** Progress of the running motion in [0, 1] and its remaining time [s]; NaN where the robot does not tell. */
    void readProgress(double[] progressAndRemaining);

    /** Checks that an item can be carried out here; nothing moves. */
    void check(Item item, String path) throws Refusal;

    /** Appends an item to what the robot carries out. Returns at once; planning errors come to the listener. */
    Job start(Item item, Mode mode, Job.Listener listener) throws Refusal;

    /** Appends items as one batch, each blended into the next as far as it says so; each has its listener. */
    Job start(Item[] batch, Mode mode, Job.Listener[] listeners) throws Refusal;

    /** Checks that a servo motion can be opened here; nothing moves. */
    void check(ServoOpen open) throws Refusal;

    /** Starts a servo motion at the present position; it takes targets once the listener has heard of its start. */
    Servo servo(ServoOpen open, Job.Listener listener) throws Refusal;

    /** Checks that an FRI session can be opened here; nothing happens. */
    void check(FriOpen open) throws Refusal;

    /** Opens an FRI session; nothing moves yet. */
    Fri fri(FriOpen open, Fri.Listener listener) throws Refusal;

    /** Brakes whatever moves on its path and drops what waits. Never blocks for long. */
    void stop();

    /** The same, as hard as the robot can. */
    void stopFast();

    void pause();

    void resume();

    /** Factor on every programmed speed, 0 to 1. */
    void setOverride(double value);

    double override();

    /** Acknowledges what software may, and lets execution go on; it need not have happened when this returns. */
    void recover() throws Refusal;

    /** Shows a text to the person at the robot. */
    void show(int severity, String text);
}
