package heptarm.core.robot;

import heptarm.core.CommandRejected;
import heptarm.wire.SafetyState;

/** Safety state of the robot. */
public interface SafetyPort {
    SafetyState read(long stamp);

    /** Acknowledges what software may acknowledge and resumes execution; the robot may need some time after this returns. */
    void recover() throws CommandRejected;
}
