package heptarm.doubles.motion;

import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.doubles.seam.RobotDescription;

/** Forward kinematics of the robot: Rz(A1) Ry(A2) Rz(A3) Ry(-A4) Rz(A5) Ry(A6) Rz(A7), all offsets along z. */
public final class ForwardKinematics {
    private final double[] links;

    public ForwardKinematics(RobotDescription robot) {
        links = new double[] {robot.dBs, robot.dSe, robot.dEw, robot.dWf};
    }

    /** Pose of the flange in the base (millimetres) for joint positions [rad]. */
    public Transformation flange(double[] q) {
        return up(links[0]).compose(z(q[0])).compose(y(q[1])).compose(up(links[1])).compose(z(q[2])).compose(y(-q[3]))
                .compose(up(links[2])).compose(z(q[4])).compose(y(q[5])).compose(up(links[3])).compose(z(q[6]));
    }

    /** Origin [m] and direction of each axis in the base, seven rows of six; the sign of a direction is arbitrary. */
    double[][] axes(double[] q) {
        double[][] found = new double[7][];
        Transformation here = Transformation.IDENTITY;
        for (int i = 0; i < 7; i++) {
            boolean turnsAboutZ = i % 2 == 0;
            here = turnsAboutZ ? here.compose(up(links[i / 2])) : here;
            Matrix r = here.getRotationMatrix();
            int column = turnsAboutZ ? 2 : 1;
            found[i] = new double[] {here.getX() * 1e-3, here.getY() * 1e-3, here.getZ() * 1e-3, r.get(0, column),
                r.get(1, column), r.get(2, column)};
            here = here.compose(turnsAboutZ ? z(q[i]) : y(i == 3 ? -q[i] : q[i]));
        }
        return found;
    }

    private static Transformation up(double metres) {
        return Transformation.ofTranslation(0, 0, metres * 1e3);
    }

    private static Transformation z(double angle) {
        return Transformation.ofRad(0, 0, 0, angle, 0, 0);
    }

    private static Transformation y(double angle) {
        return Transformation.ofRad(0, 0, 0, 0, angle, 0);
    }
}
