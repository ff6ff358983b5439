package heptarm.core;

import heptarm.wire.Code;
import heptarm.wire.Mode;
import heptarm.wire.MotionFinished;
import heptarm.wire.ServoJoints;
import heptarm.wire.ServoJointsVelocity;
import heptarm.wire.ServoPose;

/** A stream of targets that the arm follows; the newest counts. */
public final class Steering {
    private final Arm arm;
    private final Handle handle;
    private final double watchdog;

    Steering(Arm arm, Handle handle, double watchdog) {
        this.arm = arm;
        this.handle = handle;
        this.watchdog = watchdog;
    }

    /** Follow joint positions [rad]. */
    public void follow(double... q) throws Refusal {
        arm.follow(new ServoJoints(handle.id, watchdog, q));
    }

    /** Follow a pose of the moved frame in the base: x y z [m] and a unit quaternion x y z w. */
    public void follow(double[] xyz, double[] quat) throws Refusal {
        arm.follow(new ServoPose(handle.id, watchdog, xyz, quat));
    }

    /** Pass joint positions [rad] at a velocity [rad/s]. */
    public void pass(double[] q, double[] velocity) throws Refusal {
        arm.follow(new ServoJointsVelocity(handle.id, watchdog, q, velocity));
    }

    /** Changes the parameters, not the kind, of the control mode. */
    public void change(Mode mode) throws Refusal {
        arm.change(handle.id, mode);
    }

    public boolean isFinished() {
        return handle.isFinished();
    }

    /** Ends at rest. */
    public MotionFinished close() throws Refusal, InterruptedException {
        try {
            if (!handle.isFinished()) {
                arm.close(handle.id);
            }
        } catch (Refusal e) {
            if (e.code != Code.UNKNOWN_MOTION) { // it has just ended by itself
                throw e;
            }
        }
        return handle.await();
    }
}
