package heptarm.core;

import java.util.Arrays;

import heptarm.wire.Code;
import heptarm.wire.ToolInfo;

/** What has to hold between the fields of a tool or a workpiece; the ranges of single fields are checked before. */
final class ToolRules {
    /** Rounding of the moments of inertia [kg m²]. */
    private static final double ROUNDING = 1e-12;
    private static final String[] TAKEN = {"tool", "flange", "base"};

    private ToolRules() {
    }

    static void check(ToolInfo tool, String path) throws Refusal {
        plain(tool.name, path + "name");
        double[] moments = new Principal(tool.inertia).moments;
        Arrays.sort(moments);
        if (!(moments[0] >= -ROUNDING && moments[0] + moments[1] >= moments[2] - ROUNDING)) {
            throw new Refusal(Code.OUT_OF_RANGE, path + "inertia", Arrays.toString(tool.inertia),
                    "none of the principal moments negative, none above the sum of the other two", "no body has the principal"
                            + " moments " + Arrays.toString(moments) + " kg m^2");
        }
        for (int i = 0; i < tool.frames.length; i++) {
            String name = tool.frames[i].name;
            String at = path + "frames[" + i + "].name";
            plain(name, at);
            boolean taken = Arrays.asList(TAKEN).contains(name);
            for (int k = 0; k < i; k++) {
                taken |= tool.frames[k].name.equals(name);
            }
            if (taken) {
                throw new Refusal(Code.OUT_OF_RANGE, at, name, "a name that is not taken",
                        "the frame " + i + " of " + tool.name + " is called " + name + ", a name that is taken");
            }
        }
    }

    private static void plain(String name, String path) throws Refusal {
        if (name.indexOf('/') >= 0) {
            throw new Refusal(Code.OUT_OF_RANGE, path, name, "no /", "the name " + name + " has a / in it");
        }
    }
}
