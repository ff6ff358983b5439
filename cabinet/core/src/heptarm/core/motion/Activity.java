package heptarm.core.motion;

import heptarm.core.robot.MotionJob;
import heptarm.wire.Mode;

/** A program that is not a run of motions: it follows targets, or lets an FRI client command the robot. */
interface Activity {
    /** Set the id under which it was accepted. */
    void number(long id);

    /** Its control mode; null: position control. */
    Mode mode();

    /** Executes it from start to end in the motion thread. When it returns, item 0 of the program has ended. */
    void perform(Program program) throws InterruptedException;

    /** Its motion has started. */
    void started();

    /** Its motion has ended. */
    void ended(MotionJob.Outcome outcome);

    /** The program must end; wakes waiting threads. Its jobs are cancelled separately. */
    void close();
}
