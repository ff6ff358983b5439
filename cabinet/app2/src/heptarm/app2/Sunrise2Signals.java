package heptarm.app2;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.Locale;

import com.kuka.io.IIoDefinition;
import com.kuka.io.IIoDefinitionProvider;
import com.kuka.io.IIoValueProvider;
import com.kuka.sensitivity.LBR;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.SignalPort;
import heptarm.core.robot.SignalWord;
import heptarm.wire.Code;
import heptarm.wire.IoDirection;
import heptarm.wire.IoType;
import heptarm.wire.SignalInfo;

/**
 * The signals that the setting heptarm.io lists, as in 1.x; those that the cabinet does not have are left out, with a line in the
 * log. A medical robot has one more input: the state of its brake test.
 */
final class Sunrise2Signals implements SignalPort {
    /** 0: fine, 1: pending, 2: overdue, 3: motions are locked, 4: unknown. */
    private static final SignalInfo BRAKE_TEST = new SignalInfo("Med.BrakeTest", IoDirection.INPUT, IoType.UNSIGNED, 0, 4);
    private static final List<String> BRAKE_STATES = Arrays.asList("OK", "PENDING", "ERROR", "FATAL");

    private final LBR lbr;
    private final IIoValueProvider values;
    private final List<SignalInfo> infos = new ArrayList<>();
    private final List<IIoDefinition> signals = new ArrayList<>();

    Sunrise2Signals(LBR lbr, IIoDefinitionProvider definitions, IIoValueProvider values, Log log) {
        this.lbr = lbr;
        this.values = values;
        for (String word : Settings.text("heptarm.io").trim().split("\\s+")) {
            if (word.isEmpty()) {
                continue;
            }
            try {
                SignalWord found = SignalWord.of(word);
                IIoDefinition definition = definitions.getIoDefinition(found.group, found.name);
                read(definition, found.info);
                signals.add(definition);
                infos.add(found.info);
            } catch (RuntimeException e) {
                log.warn("the setting heptarm.io: " + word + " is left out: " + e.getMessage());
            }
        }
        if (Settings.text("heptarm.robot").toLowerCase(Locale.ENGLISH).contains("med")) {
            signals.add(null);
            infos.add(BRAKE_TEST);
        }
    }

    /** The state of the cyclic brake test; by reflection, since cabinets without that option lack its classes. */
    private double brakeTest() {
        try {
            Class<?> monitor = Class.forName("com.kuka.med.cyclicbraketest.IBraketestMonitor");
            int state = BRAKE_STATES.indexOf(String.valueOf(monitor.getMethod("getState").invoke(lbr.getCapability(monitor))));
            return state < 0 ? BRAKE_TEST.high : state;
        } catch (ReflectiveOperationException e) {
            return BRAKE_TEST.high;
        } catch (RuntimeException e) { // no such capability
            return BRAKE_TEST.high;
        }
    }

    private double read(IIoDefinition definition, SignalInfo info) {
        if (info.type == IoType.BOOLEAN) {
            return values.getIoValue(definition).getValueAsBoolean() ? 1.0 : 0.0;
        }
        return values.getIoValue(definition).getValue().doubleValue();
    }

    @Override
    public SignalInfo[] signals() {
        return infos.toArray(new SignalInfo[0]);
    }

    @Override
    public void read(double[] into, int from, int count) {
        for (int i = from; i < from + count; i++) {
            into[i] = infos.get(i) == BRAKE_TEST ? brakeTest() : read(signals.get(i), infos.get(i));
        }
    }

    @Override
    public void write(int[] places, double[] written) throws CommandRejected {
        for (int i = 0; i < places.length; i++) {
            SignalInfo info = infos.get(places[i]);
            try {
                write(signals.get(places[i]), info, written[i]);
            } catch (NoSuchMethodError e) { // some versions name it setOutputValue
                throw Sunrise2Robot.unsupported("values[" + i + "]", "outputs of this version");
            } catch (RuntimeException e) {
                throw new CommandRejected(Code.EXECUTION_FAILED, "values[" + i + "]", info.name, "",
                        "the cabinet refuses to write " + info.name + ": " + e.getMessage());
            }
        }
    }

    private void write(IIoDefinition definition, SignalInfo info, double value) {
        if (info.type == IoType.BOOLEAN) {
            values.setValue(definition, Boolean.valueOf(value != 0.0));
        } else if (info.type == IoType.ANALOG) {
            values.setValue(definition, value);
        } else {
            values.setValue(definition, Long.valueOf(Math.round(value)));
        }
    }
}
