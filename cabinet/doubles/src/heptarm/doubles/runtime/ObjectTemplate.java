package heptarm.doubles;

import java.util.LinkedHashMap;
import java.util.Map;

import com.kuka.roboticsAPI.geometricModel.Inertia;
import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

/** A tool or a workpiece of the project, to be made as often as an application asks. */
public final class Template {
    private final boolean isTool;
    private final double mass;
    private final double[] centre;
    private final double[] inertia;
    private final String moved;
    private String type = "";
    private final Map<String, double[]> frames = new LinkedHashMap<>();

    /**
     * @param isTool otherwise a workpiece
     * @param centre of mass and its axes: x y z [mm], a b c [rad]
     * @param inertia about those axes [kg m²]
     * @param moved path of the default motion frame; empty: the root
     */
    public Template(boolean isTool, double mass, double[] centre, double[] inertia, String moved) {
        this.isTool = isTool;
        this.mass = mass;
        this.centre = centre.clone();
        this.inertia = inertia.clone();
        this.moved = moved;
    }

    /** A frame by its path, parents first, as seen from its parent: x y z [mm], a b c [rad]. */
    public void addFrame(String path, double[] fromParent) {
        frames.put(path, fromParent.clone());
    }

    /** The project's own class of tools or workpieces, made by its name; empty: the usual. */
    public void setType(String className) {
        type = className;
    }

    private PhysicalObject bare(String name, LoadData load) {
        if (type.isEmpty()) {
            return isTool ? new Tool(name, load) : new Workpiece(name, load);
        }
        try {
            PhysicalObject made = (PhysicalObject) Class.forName(type).getConstructor(String.class).newInstance(name);
            made.getLoadData().take(load);
            return made;
        } catch (ReflectiveOperationException | ClassCastException e) {
            throw new PersistenceException("template " + name + ": " + type + " cannot be made: " + e);
        }
    }

    PhysicalObject make(String name) {
        LoadData load = new LoadData(mass, transformation(centre), Inertia.of(inertia[0], inertia[1], inertia[2]));
        PhysicalObject made = bare(name, load);
        for (Map.Entry<String, double[]> frame : frames.entrySet()) {
            int cut = frame.getKey().lastIndexOf('/');
            ObjectFrame parent = made.getFrame(cut < 0 ? "" : frame.getKey().substring(0, cut));
            parent.add(frame.getKey().substring(cut + 1), transformation(frame.getValue()));
        }
        if (moved.length() > 0) {
            made.setDefaultMotionFrame(made.getFrame(moved));
        }
        return made;
    }

    static Transformation transformation(double[] t) {
        return Transformation.ofRad(t[0], t[1], t[2], t[3], t[4], t[5]);
    }
}
