package com.kuka.roboticsAPI.ioModel;

import heptarm.doubles.Station;

/** An input or output of a group. */
public abstract class AbstractIO {
    private final Station station = Station.current();
    private final String path;
    private final String name;
    private final IOTypes type;
    private final int place;

    AbstractIO(String group, String name, IOTypes type, boolean output) {
        this.name = name;
        this.type = type;
        this.path = group + "." + name;
        this.place = station.plant.signal(path, output);
    }

    /** For the simulation. */
    public final int place() {
        return place;
    }

    /** "Group.Name"; for the simulation. */
    public final String path() {
        return path;
    }

    /** For the simulation. */
    public final IOTypes kind() {
        return type;
    }

    final String name() {
        return name;
    }

    final IOTypes type() {
        return type;
    }

    final double value() {
        return station.ring.signal(place);
    }

    final void setValue(double value) {
        station.ring.setSignal(place, value);
    }
}
