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
        double[] a = new double[SIZE * SIZE];
        double[] axis = kinematics.axes(q);
        double[] column = new double[SIZE];
        for (int n = 0; n < axis.length; n += 6) {
            double x = at.getX() * 1e-3 - axis[n];
            double y = at.getY() * 1e-3 - axis[n + 1];
            double z = at.getZ() * 1e-3 - axis[n + 2];
            double pushX = axis[n + 4] * z - axis[n + 5] * y;
            double pushY = axis[n + 5] * x - axis[n + 3] * z;
            double pushZ = axis[n + 3] * y - axis[n + 4] * x;
            for (int i = 0; i < 3; i++) {
                column[i] = axes.get(0, i) * pushX + axes.get(1, i) * pushY + axes.get(2, i) * pushZ;
                column[3 + i] = axes.get(0, i) * axis[n + 3] + axes.get(1, i) * axis[n + 4] + axes.get(2, i) * axis[n + 5];
            }
            for (int i = 0; i < SIZE; i++) {
                for (int k = 0; k <= i; k++) {
                    a[SIZE * i + k] += column[i] * column[k];
                }
            }
        }
        double[] result = diagonalOfInverse(a);
        for (int i = 0; i < SIZE; i++) {
            result[i] = SENSOR * Math.sqrt(Math.max(0.0, result[i]));
        }
        return result;
    }

    /**
     * Diagonal of the inverse by Cholesky factorisation: the damped matrix is symmetric and positive definite.
     *
     * @param a the lower triangle of the matrix; that of its factor afterwards
     */
    private static double[] diagonalOfInverse(double[] a) {
        for (int i = 0; i < SIZE; i++) {
            for (int k = 0; k <= i; k++) {
                double rest = a[SIZE * i + k] + (i == k ? DAMPED : 0.0);
                for (int j = 0; j < k; j++) {
                    rest -= a[SIZE * i + j] * a[SIZE * k + j];
                }
                a[SIZE * i + k] = i == k ? Math.sqrt(Math.max(rest, DAMPED)) : rest / a[SIZE * k + k];
            }
        }
        double[] diagonal = new double[SIZE];
        double[] y = new double[SIZE];
        for (int unit = 0; unit < SIZE; unit++) {
            for (int i = unit; i < SIZE; i++) { // the rows of the inverse of the factor, squared, add up
                double rest = i == unit ? 1.0 : 0.0;
                for (int j = unit; j < i; j++) {
                    rest -= a[SIZE * i + j] * y[j];
                }
                y[i] = rest / a[SIZE * i + i];
                diagonal[unit] += y[i] * y[i];
            }
        }
        return diagonal;
    }
}
