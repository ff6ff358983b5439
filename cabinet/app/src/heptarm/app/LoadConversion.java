package heptarm.app;

import java.lang.reflect.Constructor;

import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

import heptarm.core.Principal;
import heptarm.core.Refusal;
import heptarm.wire.Code;
import heptarm.wire.Pose;
import heptarm.wire.ToolInfo;

/** Load data of Sunrise. */
final class Loads {
    /** Where releases have the class of moments of inertia; it is asked for by name, so that one without it still runs. */
    private static final String[] INERTIA = {"com.kuka.roboticsAPI.geometricModel.Inertia",
        "com.kuka.roboticsAPI.geometricModel.math.Inertia"};

    private Loads() {
    }

    static LoadData of(ToolInfo info, String path) throws Refusal {
        boolean solid = false;
        for (int i = 0; i < info.inertia.length; i++) {
            solid |= info.inertia[i] != 0.0;
        }
        if (solid) {
            return withInertia(info, path);
        }
        LoadData load = new LoadData();
        load.setMass(info.mass);
        load.setCenterOfMass(Convert.toMillimetres(info.com[0]), Convert.toMillimetres(info.com[1]),
                Convert.toMillimetres(info.com[2]));
        return load;
    }

    private static LoadData withInertia(ToolInfo info, String path) throws Refusal {
        Principal principal = new Principal(info.inertia);
        Transformation centre = Convert.transformation(new Pose(info.com, Convert.quaternion(principal.axes)));
        double[] moments = new double[3];
        for (int i = 0; i < 3; i++) {
            moments[i] = Math.max(0.0, principal.moments[i]); // rounding
        }
        for (int i = 0; i < INERTIA.length; i++) {
            try {
                Class<?> kind = Class.forName(INERTIA[i], true, Loads.class.getClassLoader());
                Object inertia = kind.getMethod("of", double.class, double.class, double.class)
                        .invoke(null, moments[0], moments[1], moments[2]);
                Constructor<?>[] makers = LoadData.class.getConstructors();
                for (int k = 0; k < makers.length; k++) {
                    Class<?>[] wanted = makers[k].getParameterTypes();
                    if (wanted.length == 3 && wanted[0] == double.class && wanted[1].isInstance(centre) && wanted[2] == kind) {
                        return (LoadData) makers[k].newInstance(info.mass, centre, inertia);
                    }
                }
            } catch (Exception e) { // not there, or otherwise than expected
                continue;
            }
        }
        throw new Refusal(Code.UNSUPPORTED, path + "inertia", "given", "zeros", "this cabinet takes the inertia of a tool from a"
                + " template of the project only; leave it out, or define the tool in the project");
    }
}
