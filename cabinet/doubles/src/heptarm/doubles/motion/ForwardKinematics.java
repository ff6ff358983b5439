package heptarm.doubles.motion;

import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.doubles.seam.RobotDescription;

/**
 * Forward kinematics of the robot: Rz(A1) Ry(A2) Rz(A3) Ry(-A4) Rz(A5) Ry(A6) Rz(A7), all offsets along z.
 *
 * <p>Every state that a client receives needs it, so it works on plain numbers: an object for each factor would have the garbage
 * collector stop the cabinet several times a second.
 */
public final class ForwardKinematics {
    private static final int AXES = 7;

    private final double[] links;

    public ForwardKinematics(RobotDescription robot) {
        links = new double[] {robot.dBs, robot.dSe, robot.dEw, robot.dWf};
    }

    /** Pose of the flange in the base (millimetres) for joint positions [rad]. */
    public Transformation flange(double[] q) {
        Tip tip = new Tip();
        for (int i = 0; i < AXES; i++) {
            before(tip, i);
            turn(tip, i, q[i]);
        }
        return Poses.ofRows(tip.x * 1e3, tip.y * 1e3, tip.z * 1e3, tip.r);
    }

    /** Origin [m] and direction of each axis in the base, seven times six numbers; the sign of a direction is arbitrary. */
    double[] axes(double[] q) {
        double[] found = new double[6 * AXES];
        Tip tip = new Tip();
        for (int i = 0; i < AXES; i++) {
            before(tip, i);
            int column = turnsAboutZ(i) ? 2 : 1;
            int at = 6 * i;
            found[at] = tip.x;
            found[at + 1] = tip.y;
            found[at + 2] = tip.z;
            found[at + 3] = tip.r[column];
            found[at + 4] = tip.r[3 + column];
            found[at + 5] = tip.r[6 + column];
            turn(tip, i, q[i]);
        }
        return found;
    }

    private static boolean turnsAboutZ(int axis) {
        return axis % 2 == 0;
    }

    /** To the origin of an axis. */
    private void before(Tip tip, int axis) {
        if (turnsAboutZ(axis)) {
            tip.rise(links[axis / 2]);
        }
    }

    private static void turn(Tip tip, int axis, double angle) {
        if (turnsAboutZ(axis)) {
            tip.turn(angle, 0, 1);
        } else {
            tip.turn(axis == 3 ? -angle : angle, 2, 0);
        }
    }

    /** The end of the chain so far: the rows of its rotation, and its place [m]. */
    private static final class Tip {
        private final double[] r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        private double x;
        private double y;
        private double z;

        private void rise(double metres) {
            x += r[2] * metres;
            y += r[5] * metres;
            z += r[8] * metres;
        }

        /** Turns its first axis towards its second one. */
        private void turn(double angle, int first, int second) {
            double c = Math.cos(angle);
            double s = Math.sin(angle);
            for (int row = 0; row < 9; row += 3) {
                double a = r[row + first];
                double b = r[row + second];
                r[row + first] = c * a + s * b;
                r[row + second] = c * b - s * a;
            }
        }
    }
}
