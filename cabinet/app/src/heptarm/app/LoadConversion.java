package heptarm.app;

import java.lang.reflect.Constructor;

import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.core.CommandRejected;
import heptarm.core.tools.PrincipalAxes;
import heptarm.wire.Code;
import heptarm.wire.Pose;
import heptarm.wire.ToolInfo;

/** Converts loads to load data of Sunrise. */
final class LoadConversion {
    /** Class names of the moments of inertia in different releases; found by name, so that a release without it still works. */
    private static final String[] INERTIA = {"com.kuka.roboticsAPI.geometricModel.Inertia",
        "com.kuka.roboticsAPI.geometricModel.math.Inertia"};

    private LoadConversion() {
    }

    static LoadData of(ToolInfo info, String path) throws CommandRejected {
        boolean hasInertia = false;
        for (int i = 0; i < info.inertia.length; i++) {
            hasInertia |= info.inertia[i] != 0.0;
        }
        if (hasInertia) {
            return withInertia(info, path);
        }
        LoadData load = new LoadData();
        load.setMass(info.mass);
        load.setCenterOfMass(Convert.toMillimetres(info.com[0]), Convert.toMillimetres(info.com[1]),
                Convert.toMillimetres(info.com[2]));
        return load;
    }

    private static LoadData withInertia(ToolInfo info, String path) throws CommandRejected {
        PrincipalAxes principal = new PrincipalAxes(info.inertia);
        Transformation centre = Convert.transformation(new Pose(info.com, Convert.quaternion(principal.axes)));
        double[] moments = new double[3];
        for (int i = 0; i < 3; i++) {
            moments[i] = Math.max(0.0, principal.moments[i]); // rounding
        }
        for (int i = 0; i < INERTIA.length; i++) {
            try {
                Class<?> kind = Class.forName(INERTIA[i], true, LoadConversion.class.getClassLoader());
                Object inertia = kind.getMethod("of", double.class, double.class, double.class)
                        .invoke(null, moments[0], moments[1], moments[2]);
                Constructor<?>[] makers = LoadData.class.getConstructors();
                for (int k = 0; k < makers.length; k++) {
                    Class<?>[] types = makers[k].getParameterTypes();
                    if (types.length == 3 && types[0] == double.class && types[1].isInstance(centre) && types[2] == kind) {
                        return (LoadData) makers[k].newInstance(info.mass, centre, inertia);
                    }
                }
            } catch (Exception e) { // absent, or with another signature
                continue;
            }
        }
        throw new CommandRejected(Code.UNSUPPORTED, path + "inertia", "given", "zeros", "this cabinet accepts an inertia only in"
                + " a tool template of the project; leave it out, or define the tool in the project");
    }
}
