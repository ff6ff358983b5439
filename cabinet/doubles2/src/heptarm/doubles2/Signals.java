package heptarm.doubles2;

import com.kuka.io.IIoDefinition;
import com.kuka.io.IIoDefinitionProvider;
import com.kuka.io.IIoValueProvider;

import heptarm.doubles.runtime.Station;
import heptarm.sunrise1.roboticsAPI.ioModel.AbstractIOGroup;
import heptarm.sunrise1.roboticsAPI.ioModel.IOTypes;

/** The signals of the media flange. */
public final class Signals implements IIoDefinitionProvider, IIoValueProvider {
    private final Flange flange = new Flange();

    /** A value of a signal; the name of the class is unknown. */
    public interface Value {
        boolean getValueAsBoolean();

        Number getValue();
    }

    private static final class Flange extends AbstractIOGroup {
        Flange() {
            super(Station.current().controller, "MediaFlange");
        }

        void add(String name, boolean isOutput) {
            if (isOutput) {
                addDigitalOutput(name, IOTypes.BOOLEAN, 1);
            } else {
                addInput(name, IOTypes.BOOLEAN, 1);
            }
            getBooleanIOValue(name, isOutput);
        }

        void write(String name, boolean value) {
            setDigitalOutput(name, Boolean.valueOf(value));
        }
    }

    private record Signal(String name, boolean isOutput) implements IIoDefinition {
    }

    @Override
    public IIoDefinition getIoDefinition(String group, String name) {
        boolean isOutput = !name.startsWith("Input") && !name.equals("UserButton");
        if (!group.equals(flange.getIOGroupName())) {
            throw new IllegalArgumentException("no group " + group);
        }
        flange.add(name, isOutput);
        return new Signal(name, isOutput);
    }

    @Override
    public Value getIoValue(IIoDefinition signal) {
        boolean value = flange.getBooleanIOValue(((Signal) signal).name, ((Signal) signal).isOutput);
        return new Value() {
            @Override
            public boolean getValueAsBoolean() {
                return value;
            }

            @Override
            public Number getValue() {
                return value ? 1 : 0;
            }
        };
    }

    @Override
    public void setValue(IIoDefinition signal, Boolean value) {
        flange.write(((Signal) signal).name, value);
    }

    @Override
    public void setValue(IIoDefinition signal, Long value) {
        throw new IllegalArgumentException("the media flange has boolean signals");
    }

    @Override
    public void setValue(IIoDefinition signal, double value) {
        throw new IllegalArgumentException("the media flange has boolean signals");
    }
}
