package com.kuka.roboticsAPI;

import java.util.Collection;
import java.util.Collections;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.persistenceModel.IPersistenceEngine;
import com.kuka.roboticsAPI.persistenceModel.XmlApplicationDataSource;

import heptarm.doubles.runtime.NotModelled;
import heptarm.doubles.runtime.Station;

/** Cabinets and devices of the project; here one of each. */
public class RoboticsAPIContext {
    private final Station station;
    private final XmlApplicationDataSource data = new XmlApplicationDataSource();

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

    /** Prints the cabinet and the robot. */
    public void dumpDevices() {
        System.out.println(station.controller.getName() + ": " + station.robot.getName());
    }

    /** The persistence engine; there is no other. */
    public <T> T getEngine(Class<T> type) {
        if (type != IPersistenceEngine.class) {
            throw new NotModelled("getEngine of " + type.getName());
        }
        return type.cast((IPersistenceEngine) () -> data);
    }

    /** The device of a type. */
    public <T> T getDeviceFromType(Class<T> type) {
        if (!type.isInstance(station.robot)) {
            throw new IllegalArgumentException("the virtual cabinet has no " + type.getName());
        }
        return type.cast(station.robot);
    }
}
