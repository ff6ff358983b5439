package com.kuka.roboticsAPI.ioModel;

import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.FriSignal;
import heptarm.doubles.seam.SignalType;

/** An input or output of a group. */
public abstract class AbstractIO {
    private final Station station = Station.current();
    private final String group;
    private final String name;
    private final IOTypes type;
    private final int bits;
    private final int place;

    AbstractIO(String group, String name, IOTypes type, int bits, boolean output) {
        this.group = group;
        this.name = name;
        this.type = type;
        this.bits = bits;
        this.place = station.plant.signal(group + "." + name, output);
    }

    /** For the simulation. */
    public final int place() {
        return place;
    }

    /** With its group, type and range; for the simulation. */
    public final FriSignal forFri() {
        FriSignal signal = new FriSignal();
        signal.name = group + "." + name;
        signal.type = SignalType.valueOf(type.name());
        signal.isOutput = this instanceof Output;
        signal.place = place;
        signal.low = low();
        signal.high = high();
        return signal;
    }

    double low() {
        return Double.NEGATIVE_INFINITY;
    }

    double high() {
        return Double.POSITIVE_INFINITY;
    }

    public String getIOName() {
        return name;
    }

    public IOTypes getDataType() {
        return type;
    }

    /** Its width. */
    public int getBitSize() {
        return bits;
    }

    /** Whether it is set; false for the number 0. */
    public boolean getBooleanIOValue() {
        return value() != 0.0;
    }

    final double value() {
        return station.sharedState.signal(place);
    }

    final void setValue(double value) {
        station.sharedState.setSignal(place, value);
    }
}
