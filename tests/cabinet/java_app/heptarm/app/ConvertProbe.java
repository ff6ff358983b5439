package heptarm.app;

import java.io.BufferedReader;
import java.io.InputStreamReader;

import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.wire.Pose;

/** Reads x y z qx qy qz qw a line; prints Sunrise's x y z [mm] a b c [rad], and the pose that comes back from it. */
public final class ConvertProbe {
    private ConvertProbe() {
    }

    public static void main(String[] args) throws Exception {
        BufferedReader in = new BufferedReader(new InputStreamReader(System.in));
        for (String line = in.readLine(); line != null; line = in.readLine()) {
            String[] words = line.trim().split(" ");
            double[] n = new double[7];
            for (int i = 0; i < 7; i++) {
                n[i] = Double.parseDouble(words[i]);
            }
            Pose pose = new Pose(new double[] {n[0], n[1], n[2]}, new double[] {n[3], n[4], n[5], n[6]});
            Transformation t = Convert.transformation(pose);
            double[] xyz = Convert.xyz(t);
            double[] quat = Convert.quaternion(t);
            System.out.println(t.getX() + " " + t.getY() + " " + t.getZ() + " " + t.getAlphaRad() + " " + t.getBetaRad() + " "
                    + t.getGammaRad() + " " + xyz[0] + " " + xyz[1] + " " + xyz[2] + " " + quat[0] + " " + quat[1] + " " + quat[2]
                    + " " + quat[3]);
        }
    }
}
