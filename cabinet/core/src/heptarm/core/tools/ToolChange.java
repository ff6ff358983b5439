package heptarm.core.tools;

import heptarm.core.CommandRejected;
import heptarm.core.motion.MotionExecutor;
import heptarm.wire.AttachLoad;
import heptarm.wire.AttachTool;
import heptarm.wire.DefineTool;
import heptarm.wire.Message;

/** A change of tool or workpiece. It needs an idle robot: a motion is planned for the load and the frame of its start. */
public final class ToolChange implements MotionExecutor.Change {
    private final ToolTable tools;
    private final Message message;

    public ToolChange(ToolTable tools, Message message) {
        this.tools = tools;
        this.message = message;
    }

    public static boolean handles(Message message) {
        return message instanceof DefineTool || message instanceof AttachTool || message instanceof AttachLoad;
    }

    public void make() throws CommandRejected {
        if (message instanceof DefineTool) {
            tools.define(((DefineTool) message).tool, "tool.");
        } else if (message instanceof AttachTool) {
            tools.attach(((AttachTool) message).name, ((AttachTool) message).frame);
        } else {
            AttachLoad change = (AttachLoad) message;
            if (change.attached) {
                tools.load(change.load, change.template, change.safety, "load.");
            } else {
                tools.unload(change.load.name, "load.");
            }
        }
    }
}
