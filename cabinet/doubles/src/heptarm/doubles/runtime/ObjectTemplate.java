package heptarm.doubles.runtime;

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

/** A tool or workpiece template of the project; creates an instance at each request. */
public final class ObjectTemplate {
    private final boolean isTool;
    private final double mass;
    private final double[] centre;
    private final double[] inertia;
    private final String motionFrame;
    private String type = "";
    private final Map<String, double[]> frames = new LinkedHashMap<>();

    /**
     * @param isTool otherwise a workpiece
     * @param centre centre of mass and principal axes: x y z [mm], a b c [rad]
     * @param inertia about the principal axes [kg m²]
     * @param motionFrame path of the default motion frame; empty: the root
     */
    public ObjectTemplate(boolean isTool, double mass, double[] centre, double[] inertia, String motionFrame) {
        this.isTool = isTool;
        this.mass = mass;
        this.centre = centre.clone();
        this.inertia = inertia.clone();
        this.motionFrame = motionFrame;
    }

    /** Adds a frame by its path, parents first; placed in its parent: x y z [mm], a b c [rad]. */
    public void addFrame(String path, double[] fromParent) {
        frames.put(path, fromParent.clone());
    }

    /** Sets the project's own class of the tool or workpiece; empty: Tool or Workpiece. */
    public void setType(String className) {
        type = className;
    }

    private PhysicalObject instantiate(String name, LoadData load) {
        if (type.isEmpty()) {
            return isTool ? new Tool(name, load) : new Workpiece(name, load);
        }
        try {
            PhysicalObject made = (PhysicalObject) Class.forName(type).getConstructor(String.class).newInstance(name);
            made.getLoadData().take(load);
            return made;
        } catch (ReflectiveOperationException | ClassCastException e) {
            throw new PersistenceException("cannot create template " + name + " of class " + type + ": " + e);
        }
    }

    PhysicalObject make(String name) {
        LoadData load = new LoadData(mass, transformation(centre), Inertia.of(inertia[0], inertia[1], inertia[2]));
        PhysicalObject made = instantiate(name, load);
        for (Map.Entry<String, double[]> frame : frames.entrySet()) {
            int cut = frame.getKey().lastIndexOf('/');
            ObjectFrame parent = made.getFrame(cut < 0 ? "" : frame.getKey().substring(0, cut));
            parent.add(frame.getKey().substring(cut + 1), transformation(frame.getValue()));
        }
        if (motionFrame.length() > 0) {
            made.setDefaultMotionFrame(made.getFrame(motionFrame));
        }
        return made;
    }

    static Transformation transformation(double[] t) {
        return Transformation.ofRad(t[0], t[1], t[2], t[3], t[4], t[5]);
    }
}
