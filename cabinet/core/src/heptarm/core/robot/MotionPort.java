package heptarm.core.robot;

import heptarm.core.CommandRejected;
import heptarm.wire.Condition;
import heptarm.wire.FriOpen;
import heptarm.wire.Item;
import heptarm.wire.Mode;
import heptarm.wire.ServoOpen;

/**
 * Motions of the robot, in SI units.
 *
 * <p>Only the motion thread calls the methods that start motions; any thread calls the others.
 */
public interface MotionPort {
    /** Checks that an item can be executed here; nothing moves. */
    void check(Item item, String path) throws CommandRejected;

    /** Appends an item to the robot's motion queue. Returns at once; the listener receives planning errors. */
    MotionJob start(Item item, Mode mode, MotionJob.Listener listener) throws CommandRejected;

    /** Appends items as one batch, each blended into the next as far as it allows; each has its own listener. */
    MotionJob start(Item[] batch, Mode mode, MotionJob.Listener[] listeners) throws CommandRejected;

    /** Whether the robot itself monitors a break condition during a motion; otherwise the core does. */
    boolean monitors(Condition condition);

    /** Checks that a servo motion can be opened here; nothing moves. */
    void check(ServoOpen open) throws CommandRejected;

    /** Starts a servo motion at the current position; it accepts targets after the listener has received its start. */
    ServoJob openServo(ServoOpen open, MotionJob.Listener listener) throws CommandRejected;

    /** Checks that an FRI session can be opened here; nothing moves. */
    void check(FriOpen open) throws CommandRejected;

    /** Opens an FRI session; nothing moves yet. */
    FriSession openFri(FriOpen open, FriSession.Listener listener) throws CommandRejected;

    /** Brakes the current motion on its path and drops the queue. Never blocks for long. */
    void stop();

    /** Brakes as hard as the robot can and drops the queue. */
    void stopFast();

    void pause();

    void resume();

    /** Set the factor on every programmed speed, in [0, 1]. */
    void setOverride(double value);

    double override();
}
