package com.kuka.roboticsAPI.ioModel;

import java.util.ArrayList;
import java.util.Collection;
import java.util.LinkedHashMap;
import java.util.Map;

import com.kuka.roboticsAPI.controllerModel.Controller;

import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.SafetyFlags;
import heptarm.doubles.seam.StateWords;

/** Inputs and outputs of a group; base of a project's classes. The virtual cabinet has every group that is created. */
public abstract class AbstractIOGroup {
    private final String group;
    private final Map<String, Input> inputs = new LinkedHashMap<>();
    private final Map<String, Output> outputs = new LinkedHashMap<>();

    public AbstractIOGroup(Controller controller, String groupName) {
        if (controller == null) {
            throw new IllegalArgumentException("the controller of an IO group must not be null");
        }
        group = groupName;
    }

    public String getIOGroupName() {
        return group;
    }

    protected void addInput(String name, IOTypes type, int bits) {
        inputs.put(name, new Input(group, name, type, bits));
    }

    protected void addInput(String name, IOTypes type, int bits, double low, double high) {
        addInput(name, type, bits);
    }

    /** An input that no device is connected to, with its first value. */
    protected void addMockedInput(String name, IOTypes type, int bits, Object value) {
        addInput(name, type, bits);
        setMockedInput(name, value);
    }

    /** Sets an input that no device is connected to; the operator of the virtual cabinet sets it, too. */
    protected void setMockedInput(String name, Object value) {
        Input input = getInput(name);
        input.setValue(number(input, value));
    }

    protected void addDigitalOutput(String name, IOTypes type, int bits) {
        double low = type == IOTypes.INTEGER ? -Math.pow(2, bits - 1) : 0;
        double high = type == IOTypes.INTEGER ? -low - 1 : Math.pow(2, bits) - 1;
        outputs.put(name, new Output(group, name, type, bits, low, high));
    }

    /** An output that no device is connected to; here like any other. */
    protected void addMockedDigitalOutput(String name, IOTypes type, int bits) {
        addDigitalOutput(name, type, bits);
    }

    protected void addAnalogOutput(String name, IOTypes type, int bits, double low, double high) {
        outputs.put(name, new Output(group, name, type, bits, low, high));
    }

    public boolean getBooleanIOValue(String name, boolean isOutput) {
        return getIO(name, isOutput).getBooleanIOValue();
    }

    protected Number getNumberIOValue(String name, boolean isOutput) {
        return Long.valueOf(Math.round(getIO(name, isOutput).value()));
    }

    protected double getAnalogIOValue(String name, boolean isOutput) {
        return getIO(name, isOutput).value();
    }

    protected void setDigitalOutput(String name, Object value) {
        Output output = getOutput(name);
        write(output, number(output, value));
    }

    private double number(AbstractIO signal, Object value) {
        boolean truth = signal.getDataType() == IOTypes.BOOLEAN;
        if (truth != value instanceof Boolean || !truth && !(value instanceof Number)) {
            throw new IllegalArgumentException((signal instanceof Output ? "output " : "input ") + signal.getIOName() + " of " + group
                    + " is " + signal.getDataType() + ", not " + value);
        }
        return truth ? (Boolean) value ? 1.0 : 0.0 : ((Number) value).doubleValue();
    }

    protected void setAnalogOutput(String name, double value) {
        write(getOutput(name), value);
    }

    private static void write(Output output, double value) {
        output.check(value);
        long flags = Station.current().sharedState.integer(StateWords.FLAGS);
        if ((flags & SafetyFlags.EMERGENCY_STOP) != 0) {
            throw new IllegalStateException("outputs cannot be written during an emergency stop");
        }
        output.setValue(value);
    }

    public Input getInput(String name) {
        return known(inputs.get(name), name);
    }

    public Output getOutput(String name) {
        return known(outputs.get(name), name);
    }

    public Collection<Input> getInputs() {
        return new ArrayList<>(inputs.values());
    }

    public Collection<Output> getOutputs() {
        return new ArrayList<>(outputs.values());
    }

    public AbstractIO getIO(String name, boolean isOutput) {
        return isOutput ? getOutput(name) : getInput(name);
    }

    private <T> T known(T found, String name) {
        if (found == null) {
            throw new IllegalArgumentException("group " + group + " has no " + name);
        }
        return found;
    }
}
