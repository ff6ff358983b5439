package heptarm.core.api;

import heptarm.core.CommandRejected;
import heptarm.wire.Code;
import heptarm.wire.Mode;
import heptarm.wire.MotionFinished;
import heptarm.wire.ServoJoints;
import heptarm.wire.ServoJointsVelocity;
import heptarm.wire.ServoPose;

/** A stream of targets that the arm follows; the newest replaces the previous one. */
public final class ServoHandle {
    private final Arm arm;
    private final MotionHandle handle;
    private final double watchdog;

    ServoHandle(Arm arm, MotionHandle handle, double watchdog) {
        this.arm = arm;
        this.handle = handle;
        this.watchdog = watchdog;
    }

    /** Follow joint positions [rad]. */
    public void follow(double... q) throws CommandRejected {
        arm.follow(new ServoJoints(handle.id, watchdog, q));
    }

    /** Follow a pose of the motion frame in the base: x y z [m] and a unit quaternion x y z w. */
    public void follow(double[] xyz, double[] quat) throws CommandRejected {
        arm.follow(new ServoPose(handle.id, watchdog, xyz, quat));
    }

    /** Follow joint positions [rad] with a velocity at the target [rad/s]. */
    public void followVelocity(double[] q, double[] velocity) throws CommandRejected {
        arm.follow(new ServoJointsVelocity(handle.id, watchdog, q, velocity));
    }

    /** Change the parameters, not the kind, of the control mode. */
    public void changeMode(Mode mode) throws CommandRejected {
        arm.changeMode(handle.id, mode);
    }

    public boolean isFinished() {
        return handle.isFinished();
    }

    /** Brake to a stop and end the servo motion. */
    public MotionFinished close() throws CommandRejected, InterruptedException {
        try {
            if (!handle.isFinished()) {
                arm.closeServo(handle.id);
            }
        } catch (CommandRejected e) {
            if (e.code != Code.UNKNOWN_MOTION) { // it has just ended
                throw e;
            }
        }
        return handle.await();
    }
}
