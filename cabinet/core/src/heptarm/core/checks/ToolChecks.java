package heptarm.core.checks;

import java.util.Arrays;
import java.util.Locale;

import heptarm.core.CommandRejected;
import heptarm.core.tools.PrincipalAxes;
import heptarm.wire.Code;
import heptarm.wire.Shape;
import heptarm.wire.ShapeKind;
import heptarm.wire.ToolInfo;

/** Checks between the fields of a tool or a workpiece; the generated code checks the range of each field. */
public final class ToolChecks {
    /** Rounding error of the moments of inertia [kg m²]. */
    private static final double ROUNDING = 1e-12;
    /** Largest distance of a shape from its frame along an axis [m]. */
    private static final double FARTHEST = 2.0;
    private static final String[] RESERVED = {"tool", "flange", "base"};

    private ToolChecks() {
    }

    public static void check(ToolInfo tool, String path) throws CommandRejected {
        plain(tool.name, path + "name");
        for (int i = 0; i < tool.shapes.length; i++) {
            check(tool.shapes[i], path + "shapes[" + i + "].");
        }
        double[] moments = new PrincipalAxes(tool.inertia).moments;
        Arrays.sort(moments);
        if (!(moments[0] >= -ROUNDING && moments[0] + moments[1] >= moments[2] - ROUNDING)) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "inertia", Arrays.toString(tool.inertia),
                    "no principal moment negative, none above the sum of the other two", "inertia must be that of a"
                            + " real body, got principal moments " + Arrays.toString(moments) + " kg m^2; check the inertia tensor");
        }
        for (int i = 0; i < tool.frames.length; i++) {
            String name = tool.frames[i].name;
            String at = path + "frames[" + i + "].name";
            plain(name, at);
            boolean taken = Arrays.asList(RESERVED).contains(name);
            for (int k = 0; k < i; k++) {
                taken |= tool.frames[k].name.equals(name);
            }
            if (taken) {
                throw new CommandRejected(Code.OUT_OF_RANGE, at, name, "an unused name",
                        "frame " + i + " of " + tool.name + " has the name " + name + ", which is already used or reserved; choose another one");
            }
        }
    }

    /** The generated code has checked that no size is below 0 or above the largest. */
    private static void check(Shape shape, String path) throws CommandRejected {
        int count = shape.kind == ShapeKind.BOX ? 3 : shape.kind == ShapeKind.SPHERE ? 1 : 2;
        for (int i = 0; i < shape.size.length; i++) {
            if (i < count != shape.size[i] > 0.0) {
                throw new CommandRejected(Code.OUT_OF_RANGE, path + "size[" + i + "]", Double.toString(shape.size[i]), i < count ? "(0, 4]" : "0",
                        "size[" + i + "] of a " + shape.kind.name().toLowerCase(Locale.ENGLISH) + " must be " + (i < count ? "above 0" : "0") + ", got "
                                + shape.size[i] + " m");
            }
        }
        for (int i = 0; i < shape.pose.xyz.length; i++) {
            if (!(Math.abs(shape.pose.xyz[i]) <= FARTHEST)) {
                throw new CommandRejected(Code.OUT_OF_RANGE, path + "pose.xyz[" + i + "]", Double.toString(shape.pose.xyz[i]), "[-2, 2]",
                        "a shape must be within 2 m of its frame along each axis, got " + shape.pose.xyz[i] + " m");
            }
        }
    }

    private static void plain(String name, String path) throws CommandRejected {
        if (name.indexOf('/') >= 0) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path, name, "a name without /", "a name must not contain /, got " + name);
        }
    }
}
