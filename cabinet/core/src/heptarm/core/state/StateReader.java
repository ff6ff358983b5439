package heptarm.core.state;

import java.util.Arrays;

import heptarm.core.Clock;
import heptarm.core.robot.Sensors;
import heptarm.wire.Groups;
import heptarm.wire.JointState;
import heptarm.wire.PoseState;
import heptarm.wire.State;
import heptarm.wire.TorqueState;
import heptarm.wire.WrenchState;

/** Reads the robot's state; all values of a group are of the instant of its stamp. Joints come with a filtered velocity. */
public final class StateReader {
    /** Time constant of the low-pass filter of the velocity [s]. */
    private static final double FILTER = 0.01;
    private static final int JOINTS = 7;

    private final Sensors sensors;
    private final Clock clock;
    private final double[] last = new double[JOINTS];
    private final double[] velocity = new double[JOINTS];
    private long lastStamp;
    private volatile JointState newest;

    public StateReader(Sensors sensors, Clock clock) {
        this.sensors = sensors;
        this.clock = clock;
    }

    /** The current joints, with the newest known velocity. Any thread. */
    public JointState joints() {
        return read(Groups.JOINTS).joints;
    }

    /** The current torques. Any thread. */
    public TorqueState torques() {
        return read(Groups.TORQUES).torques;
    }

    /** The current pose of the motion frame. Any thread. */
    public PoseState pose() {
        return read(Groups.POSE).pose;
    }

    /** The current external wrench in the axes of the base. Any thread. */
    public WrenchState wrench() {
        return read(Groups.WRENCH).wrench;
    }

    /** The current external wrench in the axes of another frame, see {@link Sensors#readWrench(String, Pose, long)}. Any thread. */
    public WrenchState wrench(String axes) {
        clock.hold(clock.nanos());
        try {
            return sensors.readWrench(axes, null, clock.stamp());
        } finally {
            clock.release();
        }
    }

    /** Joints, torques, pose and wrench of one instant, as far as they are asked for; all others are null. Any thread. */
    public State read(int groups) {
        clock.hold(clock.nanos());
        try {
            return new State((groups & Groups.JOINTS) != 0 ? joints(clock.stamp()) : null,
                    (groups & Groups.TORQUES) != 0 ? sensors.readTorques(clock.stamp()) : null,
                    (groups & Groups.POSE) != 0 ? sensors.readPose(clock.stamp()) : null,
                    (groups & Groups.WRENCH) != 0 ? sensors.readWrench(clock.stamp()) : null, null, null, null, null);
        } finally {
            clock.release();
        }
    }

    private JointState joints(long stamp) {
        JointState read = sensors.readJoints(stamp);
        JointState sampled = newest;
        if (sampled == null) {
            Arrays.fill(read.dq, Double.NaN);
        } else {
            System.arraycopy(sampled.dq, 0, read.dq, 0, JOINTS);
        }
        return read;
    }

    /** A sample for the velocity filter, a low-pass filtered difference: the cabinet provides none. One thread only. */
    JointState sampleJoints(long stamp) {
        JointState read = sensors.readJoints(stamp);
        double[] q = read.q;
        double[] dq = read.dq;
        double dt = (stamp - lastStamp) * 1e-9;
        if (lastStamp == 0 || dt > 1.0) {
            Arrays.fill(velocity, 0.0);
            Arrays.fill(dq, lastStamp == 0 ? Double.NaN : 0.0);
        } else if (dt > 0.0) {
            double gain = 1.0 - Math.exp(-dt / FILTER);
            for (int i = 0; i < JOINTS; i++) {
                velocity[i] += gain * ((q[i] - last[i]) / dt - velocity[i]);
                dq[i] = velocity[i];
            }
        } else {
            System.arraycopy(velocity, 0, dq, 0, JOINTS);
        }
        System.arraycopy(q, 0, last, 0, JOINTS);
        lastStamp = stamp;
        newest = read;
        return read;
    }
}
