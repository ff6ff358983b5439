package heptarm.doubles.motion;

import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** Uncertainty of the estimated external wrench: the inaccuracy of the joint torque sensors, propagated through the Jacobian. */
public final class WrenchUncertainty {
    /** Inaccuracy of one joint's external torque [Nm]. */
    private static final double SENSOR = 0.5;
    /** Damping that keeps the result finite at a singularity. */
    private static final double DAMPED = 1e-6;
    private static final int SIZE = 6;

    private WrenchUncertainty() {
    }

    /**
     * Inaccuracy of force [N] and torque [Nm], six numbers.
     *
     * @param at measuring point in the base
     * @param axes axes of the result in the base
     */
    public static double[] inaccuracy(ForwardKinematics kinematics, double[] q, Transformation at, Matrix axes) {
        double[][] a = new double[SIZE][SIZE];
        for (double[] axis : kinematics.axes(q)) {
            double x = at.getX() * 1e-3 - axis[0];
            double y = at.getY() * 1e-3 - axis[1];
            double z = at.getZ() * 1e-3 - axis[2];
            double[] push = {axis[4] * z - axis[5] * y, axis[5] * x - axis[3] * z, axis[3] * y - axis[4] * x};
            double[] column = new double[SIZE];
            for (int i = 0; i < 3; i++) {
                for (int k = 0; k < 3; k++) {
                    column[i] += axes.get(k, i) * push[k];
                    column[3 + i] += axes.get(k, i) * axis[3 + k];
                }
            }
            for (int i = 0; i < SIZE; i++) {
                for (int k = 0; k < SIZE; k++) {
                    a[i][k] += column[i] * column[k];
                }
            }
        }
        double[] result = diagonalOfInverse(a);
        for (int i = 0; i < SIZE; i++) {
            result[i] = SENSOR * Math.sqrt(Math.max(0.0, result[i]));
        }
        return result;
    }

    /** Diagonal of the inverse by Cholesky factorisation: the damped matrix is symmetric and positive definite. */
    private static double[] diagonalOfInverse(double[][] a) {
        double[][] l = new double[SIZE][SIZE];
        for (int i = 0; i < SIZE; i++) {
            for (int k = 0; k <= i; k++) {
                double rest = a[i][k] + (i == k ? DAMPED : 0.0);
                for (int j = 0; j < k; j++) {
                    rest -= l[i][j] * l[k][j];
                }
                l[i][k] = i == k ? Math.sqrt(Math.max(rest, DAMPED)) : rest / l[k][k];
            }
        }
        double[] diagonal = new double[SIZE];
        for (int unit = 0; unit < SIZE; unit++) {
            double[] y = new double[SIZE];
            for (int i = unit; i < SIZE; i++) { // the rows of the inverse of l, squared, add up
                double rest = i == unit ? 1.0 : 0.0;
                for (int j = unit; j < i; j++) {
                    rest -= l[i][j] * y[j];
                }
                y[i] = rest / l[i][i];
                diagonal[unit] += y[i] * y[i];
            }
        }
        return diagonal;
    }
}
