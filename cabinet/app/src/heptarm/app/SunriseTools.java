package heptarm.app;

import java.util.Arrays;
import java.util.LinkedHashMap;
import java.util.Map;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.SimulatorProbe;
import heptarm.core.robot.ToolPort;
import heptarm.wire.Code;
import heptarm.wire.FrameInfo;
import heptarm.wire.Pose;
import heptarm.wire.Shape;
import heptarm.wire.ToolInfo;

/** Tools, workpieces and frames of Sunrise behind the core's port; the core has checked the names. */
final class SunriseTools implements ToolPort {
    private final LBR robot;
    private final IApplicationData data;
    private final SimulatorProbe probe;
    private final Map<String, Tool> templates = new LinkedHashMap<String, Tool>();
    private final Map<String, ObjectFrame> taught = new LinkedHashMap<String, ObjectFrame>();
    private final String[] listed;
    private Tool tool;
    private ToolInfo mounted;
    private Workpiece workpiece;
    private boolean hasSafetyWorkpiece;
    private Map<String, ObjectFrame> toolFrames = new LinkedHashMap<String, ObjectFrame>();
    private Map<String, ObjectFrame> pieceFrames = new LinkedHashMap<String, ObjectFrame>();
    private volatile ObjectFrame motionFrame;

    /**
     * @param data application data of the project
     * @param listed names of the project's tool templates, separated by commas
     * @param frames paths of the project's taught frames, separated by commas
     * @param probe of a simulated robot, which mounts shapes; null on a real one, which has no use for them
     */
    SunriseTools(LBR robot, IApplicationData data, String listed, String frames, SimulatorProbe probe, Log log) {
        this.robot = robot;
        this.data = data;
        this.probe = probe;
        this.listed = names(listed);
        this.motionFrame = robot.getFlange();
        reset(log);
        for (int i = 0; i < this.listed.length; i++) {
            if (template(this.listed[i]) == null) {
                log.warn("the process data heptarm.tools names " + this.listed[i] + ", but the project has no such tool template; add it in Sunrise Workbench");
            }
        }
        String[] paths = names(frames);
        for (int i = 0; i < paths.length; i++) {
            try {
                taught.put(paths[i], data.getFrame(paths[i]));
            } catch (PersistenceException e) {
                log.warn("the process data heptarm.frames names " + paths[i] + ", but the project has no such frame; teach it at the smartPAD");
            }
        }
    }

    private static String[] names(String list) {
        return list.trim().length() == 0 ? new String[0] : list.trim().split("\\s*,\\s*");
    }

    public synchronized ToolInfo[] templates() {
        ToolInfo[] all = new ToolInfo[templates.size()];
        int i = 0;
        for (Map.Entry<String, Tool> one : templates.entrySet()) {
            all[i++] = describe(one.getKey(), one.getValue());
        }
        return all;
    }

    public FrameInfo[] frames() {
        return describe(robot.getRootFrame(), taught);
    }

    public synchronized ToolInfo template(String name) {
        Tool made = templates.get(name);
        if (made == null) {
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
        return describe(name, tool.getLoadData(), tool.getRootFrame(), frames(tool));
    }

    private static ToolInfo describe(String name, LoadData load, ObjectFrame root, Map<String, ObjectFrame> frames) {
        return new ToolInfo(name, load.getMass(), new double[3], new double[6], describe(root, frames), new Shape[0]);
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

    /** Frames of a tool of the project: its default motion frame, then the children of its root. */
    private static Map<String, ObjectFrame> frames(Tool tool) {
        Map<String, ObjectFrame> all = new LinkedHashMap<String, ObjectFrame>();
        ObjectFrame main = tool.getDefaultMotionFrame();
        if (main != null && main != tool.getRootFrame()) {
            all.put(main.getName(), main);
        }
        for (Map.Entry<String, ObjectFrame> child : children(tool.getRootFrame()).entrySet()) {
            if (!all.containsKey(child.getKey())) {
                all.put(child.getKey(), child.getValue());
            }
        }
        return all;
    }

    private static Map<String, ObjectFrame> children(ObjectFrame root) {
        Map<String, ObjectFrame> all = new LinkedHashMap<String, ObjectFrame>();
        for (Object child : root.getChildren()) {
            if (child instanceof ObjectFrame) {
                all.put(((ObjectFrame) child).getName(), (ObjectFrame) child);
            }
        }
        return all;
    }

    // ------------------------------------------------------------------------------------ on the flange

    public synchronized void attach(ToolInfo info, String frame) throws CommandRejected {
        Tool next = null;
        Map<String, ObjectFrame> frames = new LinkedHashMap<String, ObjectFrame>();
        if (info != null && templates.containsKey(info.name)) {
            next = templates.get(info.name);
            frames = frames(next);
        } else if (info != null) {
            next = new Tool(info.name, LoadConversion.of(info, "tool."));
            frames = add(next, info);
        }
        ObjectFrame main = frames.containsKey(frame) ? frames.get(frame)
                : next == null ? robot.getFlange() : next.getRootFrame();
        try {
            takeOff();
            detach(tool);
            if (next != null) {
                next.attachTo(robot.getFlange());
            }
        } catch (RuntimeException e) {
            if (tool != null) {
                tool.attachTo(robot.getFlange());
            }
            putBack();
            throw new CommandRejected(Code.EXECUTION_FAILED, "the cabinet refuses the tool: " + e.getMessage());
        }
        tool = next;
        toolFrames = frames;
        workpiece = null;
        hasSafetyWorkpiece = false;
        pieceFrames = new LinkedHashMap<String, ObjectFrame>();
        motionFrame = main;
        mounted = info;
        mount(null);
    }

    public synchronized void load(ToolInfo info, boolean isSafety) throws CommandRejected {
        Workpiece next = new Workpiece(info.name, LoadConversion.of(info, "load."));
        take(next, add(next, info), isSafety);
        mount(info);
    }

    public synchronized ToolInfo loadTemplate(String name, boolean isSafety) throws CommandRejected {
        Object made;
        try {
            made = data.<Object>createFromTemplate(name);
        } catch (PersistenceException e) {
            return null;
        }
        if (!(made instanceof Workpiece)) {
            return null;
        }
        Workpiece next = (Workpiece) made;
        take(next, children(next.getRootFrame()), isSafety);
        ToolInfo info = describe(name, next.getLoadData(), next.getRootFrame(), pieceFrames);
        mount(info);
        return info;
    }

    public synchronized void unload() throws CommandRejected {
        try {
            takeOff();
        } catch (RuntimeException e) {
            putBack();
            throw new CommandRejected(Code.EXECUTION_FAILED, "the cabinet does not detach the workpiece: " + e.getMessage());
        }
        workpiece = null;
        hasSafetyWorkpiece = false;
        pieceFrames = new LinkedHashMap<String, ObjectFrame>();
        mount(null);
    }

    private void takeOff() {
        if (hasSafetyWorkpiece) {
            robot.setSafetyWorkpiece(null);
        }
        detach(workpiece);
    }

    /** Attaches the workpiece again after a refused change. */
    private void putBack() {
        if (workpiece != null) {
            workpiece.attachTo(motionFrame);
        }
        if (hasSafetyWorkpiece) {
            robot.setSafetyWorkpiece(workpiece);
        }
    }

    private void take(Workpiece next, Map<String, ObjectFrame> frames, boolean isSafety) throws CommandRejected {
        try {
            next.attachTo(motionFrame);
        } catch (RuntimeException e) {
            throw new CommandRejected(Code.EXECUTION_FAILED, "the cabinet refuses the workpiece: " + e.getMessage());
        }
        if (isSafety) {
            count(next);
        }
        hasSafetyWorkpiece = isSafety;
        workpiece = next;
        pieceFrames = frames;
    }

    /** Makes an attached workpiece the safety workpiece; detaches it if the cabinet refuses. */
    private void count(Workpiece next) throws CommandRejected {
        try {
            robot.setSafetyWorkpiece(next);
        } catch (NoSuchMethodError e) {
            detach(next);
            throw new CommandRejected(Code.UNSUPPORTED, "safety", "true", "false", "this cabinet has no safety workpiece;"
                    + " attach the workpiece without it");
        } catch (RuntimeException e) {
            detach(next);
            throw new CommandRejected(Code.OUT_OF_RANGE, "safety", "true", "false", "the cabinet refuses " + next.getName()
                    + " as the safety workpiece: " + e.getMessage() + "; check its load and the safety configuration, or attach it without safety");
        }
    }

    /** Removes the safety workpiece of an earlier application: this one has attached nothing yet. */
    private void reset(Log log) {
        try {
            robot.setSafetyWorkpiece(null);
        } catch (NoSuchMethodError e) {
            log.info("this cabinet has no safety workpiece: " + e);
        } catch (RuntimeException e) {
            log.warn("the cabinet keeps the safety workpiece of an earlier application: " + e.getMessage());
        }
    }

    /** Name of the capability; throws NoSuchMethodException on a cabinet without safety workpieces. */
    static String capability() throws NoSuchMethodException {
        LBR.class.getMethod("setSafetyWorkpiece", Workpiece.class);
        return "safety_workpieces";
    }

    private void mount(ToolInfo piece) {
        if (probe != null) {
            Transformation holding = robot.getFlange().transformationTo(motionFrame);
            probe.mount(mounted, piece, new Pose(Convert.xyz(holding), Convert.quaternion(holding)));
        }
    }

    private static void detach(PhysicalObject object) {
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

    /** The object whose load Sunrise validates for impedance control: the tool if there is one. */
    synchronized PhysicalObject carrier() {
        return tool == null ? robot : tool;
    }

    // ------------------------------------------------------------------------------------------ frames

    /** The frame that motions move. */
    ObjectFrame motionFrame() {
        return motionFrame;
    }

    /** A frame that motions can move; an empty name is the current motion frame. */
    ObjectFrame motionFrame(String name) throws CommandRejected {
        ObjectFrame found = own(name);
        if (found == null) {
            throw new CommandRejected(Code.UNKNOWN_NAME, "frame", name, movable(), "unknown frame " + name
                    + "; motions move a frame of the attached tool or workpiece, or the flange: " + movable());
        }
        return found;
    }

    /** A frame that provides axes; null for the motion frame. */
    AbstractFrame reference(String name) throws CommandRejected {
        if (name.length() == 0 || "tool".equals(name)) {
            return null;
        }
        if ("base".equals(name)) {
            return robot.getRootFrame();
        }
        return taught.containsKey(name) ? taught.get(name) : motionFrame(name);
    }

    /** A frame that provides axes: those of a pose in the base, or without one those of a named frame; null for the motion frame. */
    AbstractFrame reference(String name, Pose axes) throws CommandRejected {
        return axes == null ? reference(name) : new Frame(robot.getRootFrame(), Convert.transformation(axes));
    }

    private synchronized ObjectFrame own(String name) {
        if (name.length() == 0 || "tool".equals(name)) {
            return motionFrame;
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

    private synchronized String movable() {
        StringBuilder names = new StringBuilder("flange");
        for (Map<String, ObjectFrame> frames : Arrays.asList(toolFrames, pieceFrames)) {
            for (String name : frames.keySet()) {
                names.append(", ").append(name);
            }
        }
        return names.toString();
    }

    private static ObjectFrame qualified(PhysicalObject owner, Map<String, ObjectFrame> frames, String name) {
        if (owner == null || !name.startsWith(owner.getName() + "/")) {
            return null;
        }
        return frames.get(name.substring(owner.getName().length() + 1));
    }

    /** Refuses axes that would rotate differently from the motion frame. */
    void checkAxes(String name, ObjectFrame moved, String path) throws CommandRejected {
        AbstractFrame axes = reference(name);
        if (axes != null && axes != moved && !"base".equals(name) && !taught.containsKey(name)) {
            throw new CommandRejected(Code.UNSUPPORTED, path, name, "tool, base, a taught frame", "a control mode must use the axes"
                    + " of the motion frame, the base or a taught frame, got " + name);
        }
    }
}
