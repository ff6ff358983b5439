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

    /** Attaches a workpiece to the motion frame; null: removes it. */
    void load(ToolInfo workpiece) throws CommandRejected;
}
