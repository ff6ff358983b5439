package heptarm.fake;

import heptarm.core.CommandRejected;
import heptarm.core.robot.ToolPort;
import heptarm.wire.Code;
import heptarm.wire.FrameInfo;
import heptarm.wire.Pose;
import heptarm.wire.Shape;
import heptarm.wire.ToolInfo;

/**
 * A project with two tool templates, one of whose names is listed, a workpiece template, and a taught frame. What weighs 13 kg is
 * refused, and as the safety workpiece what weighs more than 10 kg.
 */
final class FakeTools implements ToolPort {
    private static final double REFUSED_MASS = 13.0;
    private static final double LARGEST_SAFE_MASS = 10.0;
    private static final double[] UPRIGHT = {0.0, 0.0, 0.0, 1.0};

    @Override
    public ToolInfo[] templates() {
        return new ToolInfo[] {template("listed")};
    }

    @Override
    public ToolInfo template(String name) {
        if (!"listed".equals(name) && !"hidden".equals(name)) {
            return null;
        }
        Pose tip = new Pose(new double[] {0.0, 0.0, 0.1}, UPRIGHT);
        return new ToolInfo(name, 1.0, new double[3], new double[6], new FrameInfo[] {new FrameInfo("tip", tip)}, new Shape[0]);
    }

    @Override
    public FrameInfo[] frames() {
        return new FrameInfo[] {new FrameInfo("/table", new Pose(new double[] {0.5, 0.0, 0.0}, UPRIGHT))};
    }

    @Override
    public void attach(ToolInfo tool, String motionFrame) throws CommandRejected {
        if (tool != null) {
            load(tool, false);
        }
    }

    @Override
    public void load(ToolInfo workpiece, boolean isSafety) throws CommandRejected {
        if (workpiece.mass == REFUSED_MASS) {
            throw new CommandRejected(Code.EXECUTION_FAILED, "the mass of 13 kg is refused");
        }
        if (isSafety && workpiece.mass > LARGEST_SAFE_MASS) {
            throw new CommandRejected(Code.OUT_OF_RANGE, "safety", "true", "false", "more than 10 kg");
        }
    }

    @Override
    public ToolInfo loadTemplate(String name, boolean isSafety) {
        return "block".equals(name) ? new ToolInfo(name, 0.2, new double[3], new double[6], new FrameInfo[0], new Shape[0]) : null;
    }

    @Override
    public void unload() {
    }
}
