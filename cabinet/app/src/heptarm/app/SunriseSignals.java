package heptarm.app;

import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import java.util.regex.Matcher;
import java.util.regex.Pattern;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.ioModel.AbstractIO;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.SignalPort;
import heptarm.wire.Code;
import heptarm.wire.IoDirection;
import heptarm.wire.IoType;
import heptarm.wire.SignalInfo;

/**
 * The signals that the process data heptarm.io list, separated by spaces: Group.Name&lt;type for an input, Group.Name&gt;type for
 * an output, of type bool, u8 (unsigned, 8 bits), i16, or analog12[0,10]; "flange" stands for those of a media flange.
 * Signals that the cabinet does not have are left out, with a line in the log.
 */
final class SunriseSignals implements SignalPort {
    /** Stands for the signals of the media flanges "Touch" and "IO"; no flange has all of them. */
    static final String FLANGE = "flange";
    private static final String[] FLANGE_SIGNALS = {"InputX3Pin3<bool", "InputX3Pin4<bool", "InputX3Pin10<bool", "InputX3Pin13<bool",
        "InputX3Pin16<bool", "UserButton<bool", "OutputX3Pin1>bool", "OutputX3Pin2>bool", "OutputX3Pin11>bool", "OutputX3Pin12>bool",
        "SwitchOffX3Voltage>bool", "LEDBlue>bool", "LEDRed>bool", "LEDGreen>bool"};
    private static final Pattern WORD =
            Pattern.compile("(.+)\\.([^.<>]+)([<>])(bool|u([0-9]+)|i([0-9]+)|analog([0-9]+)\\[([^,]+),([^,]+)\\])");
    private static final int MAX_BITS = 32;

    private static final class Signal {
        final IoGroup group;
        final String name;
        final SignalInfo info;

        Signal(IoGroup group, String name, SignalInfo info) {
            this.group = group;
            this.name = name;
            this.info = info;
        }
    }

    private final List<Signal> all = new ArrayList<Signal>();
    private final Map<String, IoGroup> groups = new LinkedHashMap<String, IoGroup>();
    private final Controller controller;

    SunriseSignals(Controller controller, String named, Log log) {
        this.controller = controller;
        String[] words = named.trim().split("\\s+");
        for (int i = 0; i < words.length; i++) {
            if (FLANGE.equals(words[i])) {
                for (int k = 0; k < FLANGE_SIGNALS.length; k++) {
                    add("MediaFlange." + FLANGE_SIGNALS[k], null, log);
                }
                log.info("the media flange has " + all.size() + " signals");
            } else if (words[i].length() > 0) {
                add(words[i], "the process data heptarm.io: ", log);
            }
        }
    }

    private void add(String word, String complaint, Log log) {
        try {
            Matcher parts = WORD.matcher(word);
            if (!parts.matches()) {
                throw new IllegalArgumentException("a signal must read Group.Name<type or Group.Name>type");
            }
            SignalInfo info = info(parts);
            IoGroup group = groups.get(parts.group(1));
            if (group == null) {
                group = new IoGroup(controller, parts.group(1));
                groups.put(parts.group(1), group);
            }
            group.add(parts.group(2), info, bits(parts));
            group.read(parts.group(2), info); // throws if the cabinet has no such signal
            all.add(new Signal(group, parts.group(2), info));
        } catch (RuntimeException e) {
            if (complaint != null) {
                log.warn(complaint + word + " is left out: " + e.getMessage());
            }
        }
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

    private static SignalInfo info(Matcher parts) {
        IoDirection direction = "<".equals(parts.group(3)) ? IoDirection.INPUT : IoDirection.OUTPUT;
        String name = parts.group(1) + "." + parts.group(2);
        double span = Math.pow(2, bits(parts));
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

    public SignalInfo[] signals() {
        SignalInfo[] infos = new SignalInfo[all.size()];
        for (int i = 0; i < infos.length; i++) {
            infos[i] = all.get(i).info;
        }
        return infos;
    }

    public void read(double[] values, int from, int count) {
        for (int i = from; i < from + count; i++) {
            values[i] = all.get(i).group.read(all.get(i).name, all.get(i).info);
        }
    }

    public void write(int[] places, double[] values) throws CommandRejected {
        for (int i = 0; i < places.length; i++) {
            Signal one = all.get(places[i]);
            try {
                one.group.write(one.name, one.info, values[i]);
            } catch (RuntimeException e) { // reserved by another application, or an emergency stop
                throw new CommandRejected(Code.EXECUTION_FAILED, "values[" + i + "]", one.info.name, "",
                        "the cabinet refuses to write " + one.info.name + ": " + e.getMessage());
            }
        }
    }

    /** A signal for a condition of Sunrise. */
    AbstractIO signal(String name) {
        for (Signal one : all) {
            if (one.info.name.equals(name)) {
                return one.group.signal(one.name, one.info);
            }
        }
        throw new IllegalArgumentException("unknown signal " + name);
    }
}
