package com.kuka.roboticsAPI;

import java.util.Collection;
import java.util.Collections;

import com.kuka.roboticsAPI.controllerModel.Controller;

import heptarm.doubles.runtime.Station;

/** Cabinets and devices of the project; here one of each. */
public class RoboticsAPIContext {
    private final Station station;

    /** Created by the simulation. */
    public RoboticsAPIContext(Station station) {
        this.station = station;
    }

    public Collection<Controller> getControllers() {
        return Collections.singletonList(station.controller);
    }

    public Controller getDefaultController() {
        return station.controller;
    }

    /** Not simulated: the project's data are read before the application starts, and never written. */
    public <T> T getEngine(Class<T> type) {
        throw new UnsupportedOperationException("the virtual cabinet has no " + type.getName()
                + "; it reads the project's data.xml once and does not change it");
    }

    /** The device of a type. */
    public <T> T getDeviceFromType(Class<T> type) {
        if (!type.isInstance(station.robot)) {
            throw new IllegalArgumentException("the virtual cabinet has no " + type.getName());
        }
        return type.cast(station.robot);
    }
}
