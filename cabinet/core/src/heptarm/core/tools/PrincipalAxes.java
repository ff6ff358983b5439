package heptarm.core.tools;

/** Principal moments and axes of an inertia tensor, by Jacobi rotations. */
public final class PrincipalAxes {
    private static final int SWEEPS = 50;

    /** Moments, in the order of the axes [kg m²]. */
    public final double[] moments = new double[3];
    /** Axes as the columns of a rotation matrix, right-handed. */
    public final double[][] axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

    /** Of a tensor with the entries xx yy zz xy xz yz. */
    public PrincipalAxes(double[] entries) {
        double[][] a = {{entries[0], entries[3], entries[4]}, {entries[3], entries[1], entries[5]},
            {entries[4], entries[5], entries[2]}};
        for (int sweep = 0; sweep < SWEEPS && Math.abs(a[0][1]) + Math.abs(a[0][2]) + Math.abs(a[1][2]) > 0.0; sweep++) {
            rotate(a, 0, 1);
            rotate(a, 0, 2);
            rotate(a, 1, 2);
        }
        for (int i = 0; i < 3; i++) {
            moments[i] = a[i][i];
        }
    }

    /** Rotate in the plane of two axes so that their product of inertia vanishes. */
    private void rotate(double[][] a, int p, int q) {
        if (a[p][q] == 0.0) {
            return;
        }
        double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        double t = (theta < 0 ? -1.0 : 1.0) / (Math.abs(theta) + Math.sqrt(theta * theta + 1.0));
        double c = 1.0 / Math.sqrt(t * t + 1.0);
        double s = t * c;
        for (int k = 0; k < 3; k++) {
            double kp = a[k][p];
            double kq = a[k][q];
            a[k][p] = c * kp - s * kq;
            a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; k++) {
            double pk = a[p][k];
            double qk = a[q][k];
            a[p][k] = c * pk - s * qk;
            a[q][k] = s * pk + c * qk;
        }
        a[p][q] = 0.0;
        a[q][p] = 0.0;
        for (int k = 0; k < 3; k++) {
            double kp = axes[k][p];
            double kq = axes[k][q];
            axes[k][p] = c * kp - s * kq;
            axes[k][q] = s * kp + c * kq;
        }
    }
}
