package heptarm.core.robot;

import java.util.regex.Matcher;
import java.util.regex.Pattern;

import heptarm.wire.IoDirection;
import heptarm.wire.IoType;
import heptarm.wire.SignalInfo;

/**
 * A signal of the cabinet as the setting heptarm.io names it: Group.Name&lt;type for an input, Group.Name&gt;type for an output, of
 * type bool, u8 (unsigned, 8 bits), i16, or analog12[0,10].
 */
public final class SignalWord {
    private static final Pattern WORD =
            Pattern.compile("(.+)\\.([^.<>]+)([<>])(bool|u([0-9]+)|i([0-9]+)|analog([0-9]+)\\[([^,]+),([^,]+)\\])");
    private static final int MAX_BITS = 32;

    public final String group;
    /** Within the group. */
    public final String name;
    public final int bits;
    public final SignalInfo info;

    private SignalWord(Matcher parts) {
        group = parts.group(1);
        name = parts.group(2);
        bits = bits(parts);
        info = info(parts, bits);
    }

    /**
     * Read a word.
     *
     * @throws IllegalArgumentException it names no signal
     */
    public static SignalWord of(String word) {
        Matcher parts = WORD.matcher(word);
        if (!parts.matches()) {
            throw new IllegalArgumentException("a signal must read Group.Name<type or Group.Name>type");
        }
        return new SignalWord(parts);
    }

    private static int bits(Matcher parts) {
        for (int i = 5; i <= 7; i++) {
            if (parts.group(i) != null) {
                int bits = Integer.parseInt(parts.group(i));
                if (bits < 1 || bits > MAX_BITS) {
                    throw new IllegalArgumentException("a number must have 1 to " + MAX_BITS + " bits, got " + bits);
                }
                return bits;
            }
        }
        return 1;
    }

    private static SignalInfo info(Matcher parts, int bits) {
        IoDirection direction = "<".equals(parts.group(3)) ? IoDirection.INPUT : IoDirection.OUTPUT;
        String name = parts.group(1) + "." + parts.group(2);
        double span = Math.pow(2, bits);
        if (parts.group(5) != null) {
            return new SignalInfo(name, direction, IoType.UNSIGNED, 0, span - 1);
        }
        if (parts.group(6) != null) {
            return new SignalInfo(name, direction, IoType.INTEGER, -span / 2, span / 2 - 1);
        }
        if (parts.group(7) != null) {
            double low = Double.parseDouble(parts.group(8));
            double high = Double.parseDouble(parts.group(9));
            if (!(low < high)) {
                throw new IllegalArgumentException("the range of an analog signal must ascend, got " + low + " to " + high);
            }
            return new SignalInfo(name, direction, IoType.ANALOG, low, high);
        }
        return new SignalInfo(name, direction, IoType.BOOLEAN, 0, 1);
    }
}
