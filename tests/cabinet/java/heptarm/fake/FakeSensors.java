package heptarm.fake;

import java.util.Arrays;

import heptarm.core.robot.Sensors;
import heptarm.wire.JointState;
import heptarm.wire.Pose;
import heptarm.wire.PoseState;
import heptarm.wire.Redundancy;
import heptarm.wire.TorqueState;
import heptarm.wire.WrenchState;

/** Readings of the fake axes. A spring pushes A7: the further it turns, the more. */
final class FakeSensors implements Sensors {
    private static final double SPRING = 10.0;
    private static final double INACCURACY = 0.5;

    private final FakeFaults faults;
    private final double[] q;

    /** Joint positions: shared with the motions, guarded by themselves. */
    FakeSensors(FakeFaults faults, double[] q) {
        this.faults = faults;
        this.q = q;
    }

    @Override
    public JointState readJoints(long stamp) {
        faults.read(2);
        synchronized (q) {
            return new JointState(stamp, q.clone(), q.clone(), unknown());
        }
    }

    @Override
    public TorqueState readTorques(long stamp) {
        faults.read(2);
        return new TorqueState(stamp, new double[7], new double[] {0, 0, 0, 0, 0, 0, torque()}, unknown());
    }

    private static double[] unknown() {
        double[] values = new double[7];
        Arrays.fill(values, Double.NaN);
        return values;
    }

    private double torque() {
        synchronized (q) {
            return -SPRING * q[6];
        }
    }

    @Override
    public PoseState readPose(long stamp) {
        faults.read(2);
        double[] xyz = {0.5, 0.0, 0.5};
        double[] quat = {0.0, 0.0, 0.0, 1.0};
        return new PoseState(stamp, xyz, quat, xyz, quat, new Redundancy(0.0, 2, 0));
    }

    @Override
    public WrenchState readWrench(long stamp) {
        faults.read(1);
        return readWrench("base", null, stamp);
    }

    /** The same spring pushes along the axis of the flange, which is x of the base; other axes are turned about z. */
    @Override
    public WrenchState readWrench(String frame, Pose axes, long stamp) {
        double[] force = new double[3];
        if (axes == null) {
            force["base".equals(frame) ? 0 : 2] = torque();
        } else {
            double turn = 2 * Math.atan2(axes.quat[2], axes.quat[3]);
            force[0] = Math.cos(turn) * torque();
            force[1] = -Math.sin(turn) * torque();
        }
        return new WrenchState(stamp, force, new double[3], new double[] {INACCURACY, 0, 0}, new double[3]);
    }

    @Override
    public void readProgress(double[] progressAndRemaining) {
        Arrays.fill(progressAndRemaining, Double.NaN);
    }
}
