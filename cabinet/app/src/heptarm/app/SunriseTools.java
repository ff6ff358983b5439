package heptarm.app;

import java.util.LinkedHashMap;
import java.util.Map;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

import heptarm.core.Log;
import heptarm.core.Refusal;
import heptarm.wire.Code;
import heptarm.wire.FrameInfo;
import heptarm.wire.Pose;
import heptarm.wire.ToolInfo;

/** What hangs on the flange, and the frames by their names. The core has checked the names. */
final class Tools {
    private final LBR robot;
    private final IApplicationData data;
    private final Map<String, Tool> templates = new LinkedHashMap<String, Tool>();
    private final Map<String, ObjectFrame> taught = new LinkedHashMap<String, ObjectFrame>();
    private final String[] listed;
    private Tool tool;
    private Workpiece workpiece;
    private Map<String, ObjectFrame> toolFrames = new LinkedHashMap<String, ObjectFrame>();
    private Map<String, ObjectFrame> pieceFrames = new LinkedHashMap<String, ObjectFrame>();
    private volatile ObjectFrame moved;

    /**
     * @param data of the project; null: its templates and frames are not asked for
     * @param listed names of the project's tool templates, with commas between them
     * @param frames paths of the project's taught frames, likewise
     */
    Tools(LBR robot, IApplicationData data, String listed, String frames, Log log) {
        this.robot = robot;
        this.data = data;
        this.listed = names(listed);
        this.moved = robot.getFlange();
        for (int i = 0; i < this.listed.length; i++) {
            if (template(this.listed[i]) == null) {
                log.warn("the process data heptarm.tools names " + this.listed[i] + ", but the project has no such tool template");
            }
        }
        String[] paths = names(frames);
        for (int i = 0; i < paths.length; i++) {
            try {
                taught.put(paths[i], data.getFrame(paths[i]));
            } catch (PersistenceException e) {
                log.warn("the process data heptarm.frames names " + paths[i] + ", but the project has no such frame");
            }
        }
    }

    private static String[] names(String list) {
        return list.trim().length() == 0 ? new String[0] : list.trim().split("\\s*,\\s*");
    }

    synchronized ToolInfo[] templates() {
        ToolInfo[] all = new ToolInfo[templates.size()];
        int i = 0;
        for (Map.Entry<String, Tool> one : templates.entrySet()) {
            all[i++] = describe(one.getKey(), one.getValue());
        }
        return all;
    }

    FrameInfo[] taught() {
        return describe(robot.getRootFrame(), taught);
    }

    /** The tool of a template; null if the project has none of that name. */
    synchronized ToolInfo template(String name) {
        Tool made = templates.get(name);
        if (made == null && data != null) {
            try {
                Object any = data.<Object>createFromTemplate(name);
                made = any instanceof Tool ? (Tool) any : null;
            } catch (PersistenceException e) {
                return null;
            }
            if (made != null) {
                templates.put(name, made);
            }
        }
        return made == null ? null : describe(name, made);
    }

    private static ToolInfo describe(String name, Tool tool) {
        return new ToolInfo(name, tool.getLoadData().getMass(), new double[3], new double[6],
                describe(tool.getRootFrame(), frames(tool)));
    }

    private static FrameInfo[] describe(ObjectFrame from, Map<String, ObjectFrame> frames) {
        FrameInfo[] all = new FrameInfo[frames.size()];
        int i = 0;
        for (Map.Entry<String, ObjectFrame> one : frames.entrySet()) {
            Transformation pose = from.transformationTo(one.getValue());
            all[i++] = new FrameInfo(one.getKey(), new Pose(Convert.xyz(pose), Convert.quaternion(pose)));
        }
        return all;
    }

    /** Frames of a tool of the project: the one that its motions move, then those at its root. */
    private static Map<String, ObjectFrame> frames(Tool tool) {
        Map<String, ObjectFrame> all = new LinkedHashMap<String, ObjectFrame>();
        ObjectFrame main = tool.getDefaultMotionFrame();
        if (main != null && main != tool.getRootFrame()) {
            all.put(main.getName(), main);
        }
        for (Object child : tool.getRootFrame().getChildren()) {
            if (child instanceof ObjectFrame && !all.containsKey(((ObjectFrame) child).getName())) {
                all.put(((ObjectFrame) child).getName(), (ObjectFrame) child);
            }
        }
        return all;
    }

    // ------------------------------------------------------------------------------------ on the flange

    synchronized void attach(ToolInfo info, String movedName) throws Refusal {
        Tool next = null;
        Map<String, ObjectFrame> frames = new LinkedHashMap<String, ObjectFrame>();
        if (info != null && templates.containsKey(info.name)) {
            next = templates.get(info.name);
            frames = frames(next);
        } else if (info != null) {
            next = new Tool(info.name, Loads.of(info, "tool."));
            frames = add(next, info);
        }
        ObjectFrame main = frames.containsKey(movedName) ? frames.get(movedName)
                : next == null ? robot.getFlange() : next.getRootFrame();
        Tool before = tool;
        try {
            take(workpiece);
            take(before);
            if (next != null) {
                next.attachTo(robot.getFlange());
            }
        } catch (RuntimeException e) {
            if (before != null) {
                before.attachTo(robot.getFlange());
            }
            throw new Refusal(Code.EXECUTION_FAILED, "the cabinet does not take the tool: " + e.getMessage());
        }
        tool = next;
        toolFrames = frames;
        workpiece = null;
        pieceFrames = new LinkedHashMap<String, ObjectFrame>();
        moved = main;
    }

    synchronized void load(ToolInfo info) throws Refusal {
        Map<String, ObjectFrame> frames = new LinkedHashMap<String, ObjectFrame>();
        Workpiece next = null;
        try {
            if (info != null) {
                next = new Workpiece(info.name, Loads.of(info, "load."));
                frames = add(next, info);
                next.attachTo(moved);
            } else {
                take(workpiece);
            }
        } catch (RuntimeException e) {
            throw new Refusal(Code.EXECUTION_FAILED, "the cabinet does not take the workpiece: " + e.getMessage());
        }
        workpiece = next;
        pieceFrames = frames;
    }

    private static void take(PhysicalObject object) {
        if (object instanceof Tool) {
            ((Tool) object).detach();
        } else if (object instanceof Workpiece) {
            ((Workpiece) object).detach();
        }
    }

    private static Map<String, ObjectFrame> add(PhysicalObject object, ToolInfo info) {
        Map<String, ObjectFrame> frames = new LinkedHashMap<String, ObjectFrame>();
        for (int i = 0; i < info.frames.length; i++) {
            Transformation pose = Convert.transformation(info.frames[i].pose);
            String name = info.frames[i].name;
            frames.put(name, object instanceof Tool ? ((Tool) object).addChildFrame(name, pose)
                    : ((Workpiece) object).addChildFrame(name, pose));
        }
        return frames;
    }

    /** What carries the load: Sunrise validates impedance control for the tool where there is one. */
    synchronized PhysicalObject carrier() {
        return tool == null ? robot : tool;
    }

    // ------------------------------------------------------------------------------------------ frames

    /** The frame that motions move. */
    ObjectFrame moved() {
        return moved;
    }

    /** A frame that can be moved; an empty name is the one that motions move. */
    ObjectFrame moved(String name) throws Refusal {
        ObjectFrame found = own(name);
        if (found == null) {
            throw new Refusal(Code.UNKNOWN_NAME, "frame", name, "", "no frame " + name + " can be moved here");
        }
        return found;
    }

    /** A frame that gives axes; null for those of the moved frame. */
    AbstractFrame reference(String name) throws Refusal {
        if (name.length() == 0 || "tool".equals(name)) {
            return null;
        }
        if ("base".equals(name)) {
            return robot.getRootFrame();
        }
        return taught.containsKey(name) ? taught.get(name) : moved(name);
    }

    private synchronized ObjectFrame own(String name) {
        if (name.length() == 0 || "tool".equals(name)) {
            return moved;
        }
        if ("flange".equals(name)) {
            return robot.getFlange();
        }
        if (toolFrames.containsKey(name)) {
            return toolFrames.get(name);
        }
        if (pieceFrames.containsKey(name)) {
            return pieceFrames.get(name);
        }
        ObjectFrame found = qualified(tool, toolFrames, name);
        return found == null ? qualified(workpiece, pieceFrames, name) : found;
    }

    private static ObjectFrame qualified(PhysicalObject owner, Map<String, ObjectFrame> frames, String name) {
        if (owner == null || !name.startsWith(owner.getName() + "/")) {
            return null;
        }
        return frames.get(name.substring(owner.getName().length() + 1));
    }

    /** Refuses a mode whose directions would turn otherwise than the moved frame does. */
    void checkAxes(String name, ObjectFrame motionMoves, String path) throws Refusal {
        AbstractFrame axes = reference(name);
        if (axes != null && axes != motionMoves && !"base".equals(name) && !taught.containsKey(name)) {
            throw new Refusal(Code.UNSUPPORTED, path, name, "tool, base, a taught frame", "the directions of a control mode are those"
                    + " of the moved frame or of a frame that rests, not of " + name);
        }
    }
}
