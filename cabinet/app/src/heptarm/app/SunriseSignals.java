package heptarm.app;

import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.ioModel.AbstractIO;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.SignalPort;
import heptarm.core.robot.SignalWord;
import heptarm.wire.Code;
import heptarm.wire.SignalInfo;

/**
 * The signals that the process data heptarm.io list, separated by spaces, see {@link SignalWord}; "flange" stands for those
 * of a media flange.
 * Signals that the cabinet does not have are left out, with a line in the log.
 */
final class SunriseSignals implements SignalPort {
    /** Stands for the signals of the media flanges "Touch" and "IO"; no flange has all of them. */
    static final String FLANGE = "flange";
    private static final String[] FLANGE_SIGNALS = {"InputX3Pin3<bool", "InputX3Pin4<bool", "InputX3Pin10<bool", "InputX3Pin13<bool",
        "InputX3Pin16<bool", "UserButton<bool", "OutputX3Pin1>bool", "OutputX3Pin2>bool", "OutputX3Pin11>bool", "OutputX3Pin12>bool",
        "SwitchOffX3Voltage>bool", "LEDBlue>bool", "LEDRed>bool", "LEDGreen>bool"};

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
            SignalWord signal = SignalWord.of(word);
            IoGroup group = groups.get(signal.group);
            if (group == null) {
                group = new IoGroup(controller, signal.group);
                groups.put(signal.group, group);
            }
            group.add(signal.name, signal.info, signal.bits);
            group.read(signal.name, signal.info); // throws if the cabinet has no such signal
            all.add(new Signal(group, signal.name, signal.info));
        } catch (RuntimeException e) {
            if (complaint != null) {
                log.warn(complaint + word + " is left out: " + e.getMessage());
            }
        }
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
