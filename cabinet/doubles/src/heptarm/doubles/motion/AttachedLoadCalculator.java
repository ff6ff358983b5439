package heptarm.doubles.motion;

import java.util.List;

import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.geometricModel.SceneGraphObject;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.doubles.seam.AttachedLoad;

/** Combines the load data of what is attached to a flange into one body. */
public final class AttachedLoadCalculator {
    private static final double MM = 1e-3;

    private double mass;
    private final double[] moment = new double[3]; // mass times centre [kg m]
    private final double[][] inertia = new double[3][3]; // about the flange's origin [kg m²]

    private AttachedLoadCalculator() {
    }

    /** The payload in the flange's axes: everything that is attached. */
    public static AttachedLoad of(ObjectFrame flange, List<SceneGraphObject> attached) {
        AttachedLoadCalculator total = new AttachedLoadCalculator();
        total.add(flange, attached, true);
        return total.load();
    }

    /**
     * The payload that safety functions count: what is attached besides workpieces, and the safety workpiece.
     *
     * @param workpiece null: none
     * @param at where the workpiece is, in the flange frame
     */
    public static AttachedLoad ofSafety(ObjectFrame flange, List<SceneGraphObject> attached, Workpiece workpiece, Transformation at) {
        AttachedLoadCalculator total = new AttachedLoadCalculator();
        total.add(flange, attached, false);
        if (workpiece != null) {
            total.add(workpiece.getLoadData(), at.compose(workpiece.getLoadData().centre()));
        }
        return total.load();
    }

    private AttachedLoad load() {
        AttachedLoad load = new AttachedLoad();
        load.mass = mass;
        for (int i = 0; i < 3; i++) {
            load.centre[i] = mass > 0 ? moment[i] / mass : 0.0;
        }
        double[][] own = steiner(mass, load.centre);
        double[][] i = inertia;
        load.inertia = new double[] {i[0][0] - own[0][0], i[1][1] - own[1][1], i[2][2] - own[2][2], i[0][1] - own[0][1],
            i[0][2] - own[0][2], i[1][2] - own[1][2]};
        return load;
    }

    private void add(ObjectFrame flange, List<SceneGraphObject> objects, boolean withWorkpieces) {
        for (SceneGraphObject one : objects) {
            if (one instanceof Workpiece && !withWorkpieces) {
                continue;
            }
            if (one instanceof PhysicalObject) {
                LoadData load = ((PhysicalObject) one).getLoadData();
                add(load, flange.transformationTo(((PhysicalObject) one).getRootFrame()).compose(load.centre()));
            }
            add(flange, one.getChildren(), withWorkpieces);
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
