package heptarm.doubles.motion;

import com.kuka.roboticsAPI.geometricModel.math.MatrixBuilder;
import com.kuka.roboticsAPI.geometricModel.math.MatrixRotation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.geometricModel.math.Vector;

/** Poses as the application has them, made of plain numbers. */
public final class Poses {
    private Poses() {
    }

    /** Of a place [m] and a unit quaternion (x, y, z, w), seven numbers. */
    public static Transformation ofQuaternion(double[] pose) {
        double x = pose[3];
        double y = pose[4];
        double z = pose[5];
        double w = pose[6];
        return ofRows(pose[0] * 1e3, pose[1] * 1e3, pose[2] * 1e3, new double[] {
            1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)});
    }

    /** Of a place [mm] and the rows of a rotation, nine numbers. */
    static Transformation ofRows(double x, double y, double z, double[] r) {
        MatrixBuilder rows = new MatrixBuilder().setElement00(r[0]).setElement01(r[1]).setElement02(r[2])
                .setElement10(r[3]).setElement11(r[4]).setElement12(r[5]).setElement20(r[6]).setElement21(r[7]).setElement22(r[8]);
        return Transformation.of(Vector.of(x, y, z), MatrixRotation.of(rows.toMatrix()));
    }
}
