package heptarm.core.checks;

import java.util.Arrays;

import heptarm.core.CommandRejected;
import heptarm.core.tools.PrincipalAxes;
import heptarm.wire.Code;
import heptarm.wire.ToolInfo;

/** Checks between the fields of a tool or a workpiece; the generated code checks the range of each field. */
public final class ToolChecks {
    /** Rounding error of the moments of inertia [kg m²]. */
    private static final double ROUNDING = 1e-12;
    private static final String[] RESERVED = {"tool", "flange", "base"};

    private ToolChecks() {
    }

    public static void check(ToolInfo tool, String path) throws CommandRejected {
        plain(tool.name, path + "name");
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

    private static void plain(String name, String path) throws CommandRejected {
        if (name.indexOf('/') >= 0) {
            throw new CommandRejected(Code.OUT_OF_RANGE, path, name, "a name without /", "a name must not contain /, got " + name);
        }
    }
}
