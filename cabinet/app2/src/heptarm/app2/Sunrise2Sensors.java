package heptarm.app2;

import java.util.Arrays;

import com.kuka.device.ForceData;
import com.kuka.geometry.LocalFrame;
import com.kuka.math.geometry.Transformation;
import com.kuka.math.geometry.Vector3D;
import com.kuka.sensitivity.LBR;

import heptarm.core.robot.AbcAngles;
import heptarm.core.robot.Sensors;
import heptarm.wire.JointState;
import heptarm.wire.PoseState;
import heptarm.wire.Pose;
import heptarm.wire.Redundancy;
import heptarm.wire.TorqueState;
import heptarm.wire.WrenchState;

/** Sensors of a Sunrise 2.x cabinet: commanded positions, measured torques and redundancy are unknown, hence NaN. */
final class Sunrise2Sensors implements Sensors {
    private static final double MM = 1e-3;
    private static final int JOINTS = 7;
    private static final int FORCE = 3;

    private final LBR lbr;

    Sunrise2Sensors(LBR lbr) {
        this.lbr = lbr;
    }

    /** Convert a pose in SI units. */
    static Transformation transformation(Pose pose) {
        double[] abc = AbcAngles.of(pose.quat);
        return Transformation.ofRad(pose.xyz[0] / MM, pose.xyz[1] / MM, pose.xyz[2] / MM, abc[0], abc[1], abc[2]);
    }

    private static double[] unknown(int count) {
        double[] values = new double[count];
        Arrays.fill(values, Double.NaN);
        return values;
    }

    @Override
    public JointState readJoints(long stamp) {
        return new JointState(stamp, lbr.getCurrentJointPosition().toArray().clone(), unknown(JOINTS), unknown(JOINTS));
    }

    @Override
    public TorqueState readTorques(long stamp) {
        return new TorqueState(stamp, unknown(JOINTS), lbr.getExternalTorque().getTorqueValues().clone(), unknown(JOINTS));
    }

    @Override
    public PoseState readPose(long stamp) {
        Transformation pose = flange();
        return new PoseState(stamp, new double[] {pose.getX() * MM, pose.getY() * MM, pose.getZ() * MM}, quaternion(pose),
                unknown(FORCE), unknown(FORCE + 1), new Redundancy(Double.NaN, -1, -1));
    }

    private Transformation flange() {
        LocalFrame measured = lbr.getCurrentCartesianPosition(lbr.getFlange(), lbr.getRootFrame());
        return measured.getTransformationFromParent();
    }

    private static double[] quaternion(Transformation pose) {
        return AbcAngles.quaternion(pose.getAlphaRad(), pose.getBetaRad(), pose.getGammaRad());
    }

    @Override
    public WrenchState readWrench(long stamp) {
        return readWrench("base", null, stamp);
    }

    /** As in 1.x the cabinet is taken to measure in the axes of the frame; those of the base follow from its orientation. */
    @Override
    public WrenchState readWrench(String frame, Pose axes, long stamp) {
        ForceData measured = lbr.getExternalForceTorque(lbr.getFlange());
        double[] force = array(measured.getForce());
        double[] torque = array(measured.getTorque());
        if (axes != null || "base".equals(frame)) {
            double[] quat = quaternion(flange());
            force = rotate(quat, force);
            torque = rotate(quat, torque);
        }
        if (axes != null) {
            double[] back = {-axes.quat[0], -axes.quat[1], -axes.quat[2], axes.quat[FORCE]};
            force = rotate(back, force);
            torque = rotate(back, torque);
        }
        return new WrenchState(stamp, force, torque, unknown(FORCE), unknown(FORCE));
    }

    @Override
    public void readProgress(double[] progressAndRemaining) {
        Arrays.fill(progressAndRemaining, Double.NaN);
    }

    private static double[] array(Vector3D v) {
        return new double[] {v.getX(), v.getY(), v.getZ()};
    }

    /** v + 2 r x (r x v + w v) for a unit quaternion (r, w). */
    private static double[] rotate(double[] quat, double[] v) {
        double[] t = cross(quat, v);
        for (int i = 0; i < FORCE; i++) {
            t[i] += quat[FORCE] * v[i];
        }
        double[] twice = cross(quat, t);
        return new double[] {v[0] + 2 * twice[0], v[1] + 2 * twice[1], v[2] + 2 * twice[2]};
    }

    private static double[] cross(double[] a, double[] b) {
        return new double[] {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    }
}
