package heptarm.core.robot;

/** KUKA's angles A, B, C (about z, then y, then x) and unit quaternions x y z w. */
public final class AbcAngles {
    private AbcAngles() {
    }

    /** Angles of a unit quaternion [rad]. */
    public static double[] of(double[] quat) {
        double x = quat[0];
        double y = quat[1];
        double z = quat[2];
        double w = quat[3];
        double r00 = 1 - 2 * (y * y + z * z);
        double r10 = 2 * (x * y + w * z);
        double a = Math.atan2(r10, r00);
        double ca = Math.cos(a);
        double sa = Math.sin(a);
        // b and c from the rest of the rotation after a: where a is ill-defined (b near 90 degrees) they compensate for it
        double b = Math.atan2(2 * (w * y - x * z), ca * r00 + sa * r10);
        double c = Math.atan2(sa * 2 * (x * z + w * y) - ca * 2 * (y * z - w * x),
                ca * (1 - 2 * (x * x + z * z)) - sa * 2 * (x * y - w * z));
        return new double[] {a, b, c};
    }

    /** Unit quaternion x y z w with w >= 0 of angles [rad]. */
    public static double[] quaternion(double a, double b, double c) {
        double ca = Math.cos(a / 2);
        double sa = Math.sin(a / 2);
        double cb = Math.cos(b / 2);
        double sb = Math.sin(b / 2);
        double cc = Math.cos(c / 2);
        double sc = Math.sin(c / 2);
        double[] quat = {ca * cb * sc - sa * sb * cc, ca * sb * cc + sa * cb * sc, sa * cb * cc - ca * sb * sc,
            ca * cb * cc + sa * sb * sc};
        for (int i = 0; quat[3] < 0 && i < 3; i++) {
            quat[i] = -quat[i];
        }
        quat[3] = Math.abs(quat[3]);
        return quat;
    }
}
