package heptarm.doubles;

import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** How far the estimate of an external force may be off: the torque sensors' inaccuracy, as the posture passes it on. */
public final class Estimate {
    /** Inaccuracy of a joint's external torque [Nm]. */
    private static final double SENSOR = 0.5;
    /** Keeps it finite at a singularity. */
    private static final double DAMPED = 1e-6;
    private static final int SIZE = 6;

    private Estimate() {
    }

    /**
     * Of force [N] and torque [Nm], six numbers.
     *
     * @param at point of the estimate in the base
     * @param seenFrom axes of the numbers in the base
     */
    public static double[] inaccuracy(Arm arm, double[] q, Transformation at, Matrix seenFrom) {
        double[][] a = new double[SIZE][SIZE];
        for (double[] axis : arm.axes(q)) {
            double x = at.getX() * 1e-3 - axis[0];
            double y = at.getY() * 1e-3 - axis[1];
            double z = at.getZ() * 1e-3 - axis[2];
            double[] push = {axis[4] * z - axis[5] * y, axis[5] * x - axis[3] * z, axis[3] * y - axis[4] * x};
            double[] column = new double[SIZE];
            for (int i = 0; i < 3; i++) {
                for (int k = 0; k < 3; k++) {
                    column[i] += seenFrom.get(k, i) * push[k];
                    column[3 + i] += seenFrom.get(k, i) * axis[3 + k];
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

    /** By Cholesky: the matrix is symmetric and, damped, positive. */
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
