package heptarm.app;

import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.wire.Pose;

/** The one place where metres and quaternions meet millimetres and angles about z, y, x. */
final class Convert {
    private static final double MM = 1e-3;

    private Convert() {
    }

    static double toMillimetres(double metres) {
        return metres / MM;
    }

    /** Sunrise's form of a pose in SI. */
    static Transformation transformation(Pose pose) {
        double x = pose.quat[0];
        double y = pose.quat[1];
        double z = pose.quat[2];
        double w = pose.quat[3];
        double r00 = 1 - 2 * (y * y + z * z);
        double r10 = 2 * (x * y + w * z);
        double a = Math.atan2(r10, r00);
        double ca = Math.cos(a);
        double sa = Math.sin(a);
        // b and c from what is left when a is taken off: where a is ill-defined (b near 90 degrees) they make up for it
        double b = Math.atan2(2 * (w * y - x * z), ca * r00 + sa * r10);
        double c = Math.atan2(sa * 2 * (x * z + w * y) - ca * 2 * (y * z - w * x),
                ca * (1 - 2 * (x * x + z * z)) - sa * 2 * (x * y - w * z));
        return Transformation.ofRad(pose.xyz[0] / MM, pose.xyz[1] / MM, pose.xyz[2] / MM, a, b, c);
    }

    static double[] xyz(ITransformation t) {
        return new double[] {t.getX() * MM, t.getY() * MM, t.getZ() * MM};
    }

    /** Unit quaternion x y z w with w not negative; the largest component leads, so that it is accurate everywhere. */
    static double[] quaternion(Transformation t) {
        Matrix m = t.getRotationMatrix();
        return quaternion(new double[][] {{m.getElement00(), m.getElement01(), m.getElement02()},
            {m.getElement10(), m.getElement11(), m.getElement12()}, {m.getElement20(), m.getElement21(), m.getElement22()}});
    }

    /** The same of a rotation matrix. */
    static double[] quaternion(double[][] r) {
        double trace = r[0][0] + r[1][1] + r[2][2];
        int lead = 3;
        double most = trace;
        for (int i = 0; i < 3; i++) {
            if (r[i][i] > most) {
                most = r[i][i];
                lead = i;
            }
        }
        double[] q = new double[4];
        if (lead == 3) {
            q[0] = r[2][1] - r[1][2];
            q[1] = r[0][2] - r[2][0];
            q[2] = r[1][0] - r[0][1];
            q[3] = 1.0 + trace;
        } else {
            int j = (lead + 1) % 3;
            int k = (lead + 2) % 3;
            q[lead] = 1.0 + r[lead][lead] - r[j][j] - r[k][k];
            q[j] = r[j][lead] + r[lead][j];
            q[k] = r[k][lead] + r[lead][k];
            q[3] = r[k][j] - r[j][k];
        }
        double norm = Math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        norm = q[3] < 0 ? -norm : norm;
        for (int i = 0; i < 4; i++) {
            q[i] /= norm;
        }
        return q;
    }
}
