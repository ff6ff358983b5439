package heptarm.doubles.motion;

import java.util.List;

import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.geometricModel.SceneGraphObject;
import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.doubles.seam.AttachedLoad;

/** Combines the load data of everything attached to a flange into one body. */
public final class AttachedLoadCalculator {
    private static final double MM = 1e-3;

    private double mass;
    private final double[] moment = new double[3]; // mass times centre [kg m]
    private final double[][] inertia = new double[3][3]; // about the flange's origin [kg m²]

    private AttachedLoadCalculator() {
    }

    /** The payload in the flange's axes. */
    public static AttachedLoad of(ObjectFrame flange, List<SceneGraphObject> attached) {
        AttachedLoadCalculator total = new AttachedLoadCalculator();
        total.add(flange, attached);
        AttachedLoad load = new AttachedLoad();
        load.mass = total.mass;
        for (int i = 0; i < 3; i++) {
            load.centre[i] = total.mass > 0 ? total.moment[i] / total.mass : 0.0;
        }
        double[][] own = steiner(total.mass, load.centre);
        double[][] i = total.inertia;
        load.inertia = new double[] {i[0][0] - own[0][0], i[1][1] - own[1][1], i[2][2] - own[2][2], i[0][1] - own[0][1],
            i[0][2] - own[0][2], i[1][2] - own[1][2]};
        return load;
    }

    private void add(ObjectFrame flange, List<SceneGraphObject> objects) {
        for (SceneGraphObject one : objects) {
            if (one instanceof PhysicalObject) {
                LoadData load = ((PhysicalObject) one).getLoadData();
                add(load, flange.transformationTo(((PhysicalObject) one).getRootFrame()).compose(load.centre()));
            }
            add(flange, one.getChildren());
        }
    }

    private void add(LoadData load, Transformation centre) {
        double[] c = {centre.getX() * MM, centre.getY() * MM, centre.getZ() * MM};
        double[] principal = {load.inertia().getX(), load.inertia().getY(), load.inertia().getZ()};
        double[][] shift = steiner(load.getMass(), c);
        Matrix r = centre.getRotationMatrix();
        mass += load.getMass();
        for (int i = 0; i < 3; i++) {
            moment[i] += load.getMass() * c[i];
            for (int j = 0; j < 3; j++) {
                inertia[i][j] += shift[i][j];
                for (int k = 0; k < 3; k++) {
                    inertia[i][j] += r.get(i, k) * principal[k] * r.get(j, k);
                }
            }
        }
    }

    /** Inertia of a point mass about the origin (parallel axis theorem). */
    private static double[][] steiner(double mass, double[] c) {
        double square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
        double[][] result = new double[3][3];
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                result[i][j] = mass * ((i == j ? square : 0.0) - c[i] * c[j]);
            }
        }
        return result;
    }
}
