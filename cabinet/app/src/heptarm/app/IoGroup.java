package heptarm.app;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.ioModel.AbstractIO;
import com.kuka.roboticsAPI.ioModel.AbstractIOGroup;
import com.kuka.roboticsAPI.ioModel.IOTypes;

import heptarm.wire.IoDirection;
import heptarm.wire.IoType;
import heptarm.wire.SignalInfo;

/** A group of the cabinet's inputs and outputs, like the classes that a project generates, but for any group. */
final class IoGroup extends AbstractIOGroup {
    IoGroup(Controller controller, String name) {
        super(controller, name);
    }

    /** Register a signal; an unknown one throws here or when it is read. */
    void add(String name, SignalInfo info, int bits) {
        IOTypes type = type(info.type);
        if (info.direction == IoDirection.INPUT) {
            addInput(name, type, bits);
        } else if (info.type == IoType.ANALOG) {
            addAnalogOutput(name, type, bits, info.low, info.high);
        } else {
            addDigitalOutput(name, type, bits);
        }
    }

    private static IOTypes type(IoType type) {
        if (type == IoType.BOOLEAN) {
            return IOTypes.BOOLEAN;
        }
        if (type == IoType.ANALOG) {
            return IOTypes.ANALOG;
        }
        return type == IoType.INTEGER ? IOTypes.INTEGER : IOTypes.UNSIGNED_INTEGER;
    }

    double read(String name, SignalInfo info) {
        boolean output = info.direction == IoDirection.OUTPUT;
        if (info.type == IoType.BOOLEAN) {
            return getBooleanIOValue(name, output) ? 1.0 : 0.0;
        }
        return info.type == IoType.ANALOG ? getAnalogIOValue(name, output) : getNumberIOValue(name, output).doubleValue();
    }

    void write(String name, SignalInfo info, double value) {
        if (info.type == IoType.BOOLEAN) {
            setDigitalOutput(name, Boolean.valueOf(value != 0.0));
        } else if (info.type == IoType.ANALOG) {
            setAnalogOutput(name, value);
        } else {
            setDigitalOutput(name, Long.valueOf(Math.round(value)));
        }
    }

    AbstractIO signal(String name, SignalInfo info) {
        return getIO(name, info.direction == IoDirection.OUTPUT);
    }
}
