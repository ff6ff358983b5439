package heptarm.core;

import heptarm.wire.Mode;

/** What a program does that is no run of motions: it follows targets, or lets an FRI client command. */
interface Activity {
    /** The number under which it was accepted. */
    void number(long id);

    /** Its control mode; null: position control. */
    Mode mode();

    /** Carries it out from start to end; called by the motion thread. When it returns, item 0 of the program has ended. */
    void perform(Program program) throws InterruptedException;

    /** Its motion has begun. */
    void begun();

    /** Its motion has ended. */
    void over(Job.Ended how);

    /** The program is to end; whoever waits need not. Its jobs are cancelled besides. */
    void close();
}
