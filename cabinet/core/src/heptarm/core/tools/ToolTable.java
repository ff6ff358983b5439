package heptarm.core;

import java.util.LinkedHashMap;
import java.util.Map;

import heptarm.wire.Code;
import heptarm.wire.FrameInfo;
import heptarm.wire.ToolInfo;

/**
 * The tools that are known, what hangs on the flange, and the names of all frames.
 *
 * <p>A tool is known because a client has defined it, or because the project has a template of its name. Its frames go by
 * their names; "name/frame" also tells a workpiece's frame from one of the tool's.
 */
final class Rack {
    private static final String FLANGE = "flange";
    private static final String BASE = "base";
    private static final String TOOL = "tool";

    private final Robot robot;
    private final Map<String, ToolInfo> defined = new LinkedHashMap<String, ToolInfo>();
    private ToolInfo tool;
    private ToolInfo workpiece;
    private String moved = FLANGE;

    Rack(Robot robot) {
        this.robot = robot;
    }

    /** Templates of the project as far as their names are known, then what clients have defined. */
    synchronized ToolInfo[] known() {
        Map<String, ToolInfo> all = new LinkedHashMap<String, ToolInfo>();
        ToolInfo[] templates = robot.tools();
        for (int i = 0; i < templates.length; i++) {
            all.put(templates[i].name, templates[i]);
        }
        all.putAll(defined);
        return all.values().toArray(new ToolInfo[all.size()]);
    }

    /** Names of tool, workpiece (empty: none) and moved frame. */
    synchronized String[] fitted() {
        return new String[] {tool == null ? "" : tool.name, workpiece == null ? "" : workpiece.name, moved};
    }

    synchronized void define(ToolInfo newer, String path) throws Refusal {
        ToolRules.check(newer, path);
        if (robot.template(newer.name) != null) {
            throw new Refusal(Code.OUT_OF_RANGE, path + "name", newer.name, "a name that no template has",
                    "the project has a template " + newer.name + "; attach that, or choose another name");
        }
        boolean attached = tool != null && tool.name.equals(newer.name);
        if (attached) {
            fit(newer, has(newer, moved) ? moved : "");
        }
        defined.put(newer.name, newer);
    }

    synchronized void attach(String name, String frame) throws Refusal {
        if (name.length() == 0) {
            fit(null, "");
            return;
        }
        ToolInfo chosen = defined.get(name);
        if (chosen == null) {
            chosen = robot.template(name);
        }
        if (chosen == null) {
            StringBuilder names = new StringBuilder();
            ToolInfo[] all = known();
            for (int i = 0; i < all.length; i++) {
                names.append(i == 0 ? "" : ", ").append(all[i].name);
            }
            throw new Refusal(Code.UNKNOWN_NAME, "name", name, names.toString(), "no tool " + name
                    + " is defined, and the project has no template of that name");
        }
        if (frame.length() > 0 && !has(chosen, frame)) {
            throw new Refusal(Code.UNKNOWN_NAME, "frame", frame, names(chosen), "the tool " + name + " has no frame " + frame);
        }
        fit(chosen, frame);
    }

    /** The robot first: if it refuses, nothing has changed here. */
    private void fit(ToolInfo chosen, String frame) throws Refusal {
        String main = frame;
        if (main.length() == 0) {
            main = chosen == null || chosen.frames.length == 0 ? FLANGE : chosen.frames[0].name;
        }
        robot.attach(chosen, main);
        tool = chosen;
        moved = main;
        workpiece = null;
    }

    synchronized void load(ToolInfo newer, boolean attached, String path) throws Refusal {
        ToolRules.check(newer, path);
        String present = workpiece == null ? "" : workpiece.name;
        if (!attached) {
            if (!newer.name.equals(present)) {
                throw new Refusal(Code.UNKNOWN_NAME, path + "name", newer.name, present, "no workpiece " + newer.name + " is attached");
            }
            robot.load(null);
            workpiece = null;
            return;
        }
        if (workpiece != null) {
            throw new Refusal(Code.BUSY, path + "name", newer.name, "", "the workpiece " + present + " is attached; detach it first");
        }
        robot.load(newer);
        workpiece = newer;
    }

    /** Refuses the name of a frame that cannot be moved. */
    synchronized void checkMoved(String name, String path) throws Refusal {
        if (!moves(name)) {
            throw unknown(name, path, "");
        }
    }

    /** Refuses the name of a frame that gives no axes. */
    synchronized void checkReference(String name, String path) throws Refusal {
        if (moves(name) || BASE.equals(name)) {
            return;
        }
        StringBuilder more = new StringBuilder(", " + BASE);
        FrameInfo[] taught = robot.frames();
        for (int i = 0; i < taught.length; i++) {
            if (taught[i].name.equals(name)) {
                return;
            }
            more.append(", ").append(taught[i].name);
        }
        throw unknown(name, path, more.toString());
    }

    private boolean moves(String name) {
        return name.length() == 0 || TOOL.equals(name) || FLANGE.equals(name) || belongs(tool, name) || belongs(workpiece, name);
    }

    private Refusal unknown(String name, String path, String more) {
        StringBuilder all = new StringBuilder(TOOL + ", " + FLANGE);
        if (tool != null && tool.frames.length > 0) {
            all.append(", ").append(names(tool));
        }
        if (workpiece != null && workpiece.frames.length > 0) {
            all.append(", ").append(names(workpiece));
        }
        return new Refusal(Code.UNKNOWN_NAME, path, name, all.append(more).toString(), "no frame " + name + " is known here"
                + (tool == null ? "; no tool is attached" : "; the tool " + tool.name + " is attached"));
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
