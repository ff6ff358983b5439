package heptarm.core.tools;

import java.util.LinkedHashMap;
import java.util.Map;

import heptarm.core.CommandRejected;
import heptarm.core.EventBus;
import heptarm.core.checks.ToolChecks;
import heptarm.core.robot.ToolPort;
import heptarm.wire.Code;
import heptarm.wire.FrameInfo;
import heptarm.wire.ToolChanged;
import heptarm.wire.ToolInfo;

/**
 * The known tools, the attached tool and workpiece, and the names of all frames.
 *
 * <p>A tool is known because a client has defined it, or because the project has a template with its name. Frames are found by
 * name; "name/frame" distinguishes a workpiece's frame from one of the tool's.
 */
public final class ToolTable {
    private static final String FLANGE = "flange";
    private static final String BASE = "base";
    private static final String TOOL = "tool";

    private final ToolPort port;
    private final EventBus events;
    private final Map<String, ToolInfo> defined = new LinkedHashMap<String, ToolInfo>();
    private ToolInfo tool;
    private ToolInfo workpiece;
    private boolean isSafety;
    private String motionFrame = FLANGE;

    /** @param events receives each change of what is attached */
    public ToolTable(ToolPort port, EventBus events) {
        this.port = port;
        this.events = events;
    }

    /** Templates of the project whose names are known, then the tools that clients have defined. */
    public synchronized ToolInfo[] known() {
        Map<String, ToolInfo> all = new LinkedHashMap<String, ToolInfo>();
        ToolInfo[] templates = port.templates();
        for (int i = 0; i < templates.length; i++) {
            all.put(templates[i].name, templates[i]);
        }
        all.putAll(defined);
        return all.values().toArray(new ToolInfo[all.size()]);
    }

    /** Names of tool and workpiece (empty: none), of the motion frame, and of the safety workpiece (empty: none). */
    public synchronized String[] attached() {
        String held = workpiece == null ? "" : workpiece.name;
        return new String[] {tool == null ? "" : tool.name, held, motionFrame, isSafety ? held : ""};
    }

    synchronized void define(ToolInfo newer, String path) throws CommandRejected {
        ToolChecks.check(newer, path);
        if (port.template(newer.name) != null) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "name", newer.name, "a name that no template has",
                    "the project already has a tool template " + newer.name + "; attach it, or choose another name");
        }
        boolean isAttached = tool != null && tool.name.equals(newer.name);
        if (isAttached) {
            exchange(newer, has(newer, motionFrame) ? motionFrame : "");
        }
        defined.put(newer.name, newer);
    }

    synchronized void attach(String name, String frame) throws CommandRejected {
        if (name.length() == 0) {
            exchange(null, "");
            return;
        }
        ToolInfo chosen = defined.get(name);
        if (chosen == null) {
            chosen = port.template(name);
        }
        if (chosen == null) {
            StringBuilder names = new StringBuilder();
            ToolInfo[] all = known();
            for (int i = 0; i < all.length; i++) {
                names.append(i == 0 ? "" : ", ").append(all[i].name);
            }
            throw new CommandRejected(Code.UNKNOWN_NAME, "name", name, names.toString(), "no tool " + name
                    + " is defined, and the project has no template of that name");
        }
        if (frame.length() > 0 && !has(chosen, frame)) {
            throw new CommandRejected(Code.UNKNOWN_NAME, "frame", frame, names(chosen), "the tool " + name + " has no frame " + frame);
        }
        exchange(chosen, frame);
    }

    /** Changes the robot first: if it refuses, nothing has changed here. */
    private void exchange(ToolInfo chosen, String frame) throws CommandRejected {
        String main = frame;
        if (main.length() == 0) {
            main = chosen == null || chosen.frames.length == 0 ? FLANGE : chosen.frames[0].name;
        }
        port.attach(chosen, main);
        tool = chosen;
        motionFrame = main;
        workpiece = null;
        isSafety = false;
        events.publish(new ToolChanged(tool, workpiece));
    }

    /** @param isTemplate the workpiece is that of the project's template of the same name */
    synchronized void load(ToolInfo newer, boolean isTemplate, boolean safety, String path) throws CommandRejected {
        ToolChecks.check(newer, path);
        if (workpiece != null) {
            throw new CommandRejected(Code.BUSY, path + "name", newer.name, "", "workpiece " + workpiece.name + " is attached; detach it first");
        }
        ToolInfo held = newer;
        if (isTemplate) {
            held = port.loadTemplate(newer.name, safety);
        } else {
            port.load(newer, safety);
        }
        if (held == null) {
            throw new CommandRejected(Code.UNKNOWN_NAME, path + "name", newer.name, "", "the project has no workpiece template "
                    + newer.name + "; add it in Sunrise Workbench, or give the workpiece's mass instead of its name");
        }
        workpiece = held;
        isSafety = safety;
        events.publish(new ToolChanged(tool, workpiece));
    }

    synchronized void unload(String name, String path) throws CommandRejected {
        String present = workpiece == null ? "" : workpiece.name;
        if (!name.equals(present)) {
            throw new CommandRejected(Code.UNKNOWN_NAME, path + "name", name, present, "workpiece " + name + " is not attached; attached: " + (present.length() == 0 ? "none" : present));
        }
        port.unload();
        workpiece = null;
        isSafety = false;
        events.publish(new ToolChanged(tool, workpiece));
    }

    /** Refuses a frame name that cannot be a motion frame. */
    public synchronized void checkMotionFrame(String name, String path) throws CommandRejected {
        if (!isMotionFrame(name)) {
            throw unknown(name, path, "");
        }
    }

    /** Refuses a frame name that cannot provide axes. */
    public synchronized void checkReference(String name, String path) throws CommandRejected {
        if (isMotionFrame(name) || BASE.equals(name)) {
            return;
        }
        StringBuilder more = new StringBuilder(", " + BASE);
        FrameInfo[] taught = port.frames();
        for (int i = 0; i < taught.length; i++) {
            if (taught[i].name.equals(name)) {
                return;
            }
            more.append(", ").append(taught[i].name);
        }
        throw unknown(name, path, more.toString());
    }

    private boolean isMotionFrame(String name) {
        return name.length() == 0 || TOOL.equals(name) || FLANGE.equals(name) || belongs(tool, name) || belongs(workpiece, name);
    }

    private CommandRejected unknown(String name, String path, String more) {
        StringBuilder all = new StringBuilder(TOOL + ", " + FLANGE);
        if (tool != null && tool.frames.length > 0) {
            all.append(", ").append(names(tool));
        }
        if (workpiece != null && workpiece.frames.length > 0) {
            all.append(", ").append(names(workpiece));
        }
        return new CommandRejected(Code.UNKNOWN_NAME, path, name, all.append(more).toString(), "unknown frame " + name + " ("
                + (tool == null ? "no tool is attached" : "tool " + tool.name + " is attached") + "); known frames: " + all);
    }

    private static boolean belongs(ToolInfo owner, String name) {
        if (owner == null) {
            return false;
        }
        String own = owner.name + "/";
        return has(owner, name) || name.startsWith(own) && has(owner, name.substring(own.length()));
    }

    private static boolean has(ToolInfo owner, String frame) {
        for (int i = 0; i < owner.frames.length; i++) {
            if (owner.frames[i].name.equals(frame)) {
                return true;
            }
        }
        return false;
    }

    private static String names(ToolInfo owner) {
        StringBuilder all = new StringBuilder();
        for (int i = 0; i < owner.frames.length; i++) {
            all.append(i == 0 ? "" : ", ").append(owner.frames[i].name);
        }
        return all.toString();
    }
}
