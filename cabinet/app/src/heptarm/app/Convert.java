package heptarm.app;

import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.core.robot.AbcAngles;
import heptarm.wire.Pose;

/** Converts between metres and quaternions and Sunrise's millimetres and A-B-C angles; nothing else does. */
final class Convert {
    private static final double MM = 1e-3;

    private Convert() {
    }

    static double toMillimetres(double metres) {
        return metres / MM;
    }

    /** Convert a pose in SI units. */
    static Transformation transformation(Pose pose) {
        double[] abc = AbcAngles.of(pose.quat);
        return Transformation.ofRad(pose.xyz[0] / MM, pose.xyz[1] / MM, pose.xyz[2] / MM, abc[0], abc[1], abc[2]);
    }

    static double[] xyz(ITransformation t) {
        return new double[] {t.getX() * MM, t.getY() * MM, t.getZ() * MM};
    }

    /** Unit quaternion x y z w with w >= 0; starts from the largest component, so that it is accurate everywhere. */
    static double[] quaternion(Transformation t) {
        Matrix m = t.getRotationMatrix();
        return quaternion(new double[][] {{m.getElement00(), m.getElement01(), m.getElement02()},
            {m.getElement10(), m.getElement11(), m.getElement12()}, {m.getElement20(), m.getElement21(), m.getElement22()}});
    }

    /** Unit quaternion of a rotation matrix. */
    static double[] quaternion(double[][] r) {
        double trace = r[0][0] + r[1][1] + r[2][2];
        int largest = 3;
        double most = trace;
        for (int i = 0; i < 3; i++) {
            if (r[i][i] > most) {
                most = r[i][i];
                largest = i;
            }
        }
        double[] q = new double[4];
        if (largest == 3) {
            q[0] = r[2][1] - r[1][2];
            q[1] = r[0][2] - r[2][0];
            q[2] = r[1][0] - r[0][1];
            q[3] = 1.0 + trace;
        } else {
            int j = (largest + 1) % 3;
            int k = (largest + 2) % 3;
            q[largest] = 1.0 + r[largest][largest] - r[j][j] - r[k][k];
            q[j] = r[j][largest] + r[largest][j];
            q[k] = r[k][largest] + r[largest][k];
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
