package heptarm.core.robot;

import heptarm.core.CommandRejected;
import heptarm.wire.FrameInfo;
import heptarm.wire.ToolInfo;

/** Tools, workpieces and frames of the robot. */
public interface ToolPort {
    /** Tool templates of the project whose names the robot knows. */
    ToolInfo[] templates();

    /** The tool of a template of the project; null if there is no such template. */
    ToolInfo template(String name);

    /** Taught frames of the project. */
    FrameInfo[] frames();

    /** Replaces the attached tool (null: none) and removes the workpiece; motions move the named frame from now on. */
    void attach(ToolInfo tool, String motionFrame) throws CommandRejected;

    /**
     * Attaches a workpiece to the motion frame. If the robot refuses, nothing is attached.
     *
     * @param isSafety also as the safety workpiece, whose load the safety functions count
     */
    void load(ToolInfo workpiece, boolean isSafety) throws CommandRejected;

    /** The same with the workpiece of a template of the project; returns what is known of it, null if there is no such template. */
    ToolInfo loadTemplate(String name, boolean isSafety) throws CommandRejected;

    /** Removes the workpiece; afterwards there is no safety workpiece either. */
    void unload() throws CommandRejected;
}
