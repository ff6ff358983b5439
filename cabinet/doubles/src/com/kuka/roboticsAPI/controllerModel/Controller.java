package com.kuka.roboticsAPI.controllerModel;

import java.util.Collection;
import java.util.Collections;

import com.kuka.roboticsAPI.RoboticsAPIContext;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseExecutionService;
import com.kuka.roboticsAPI.deviceModel.Device;

import heptarm.doubles.runtime.Station;
import heptarm.doubles.runtime.TorqueReferencing;

/** The cabinet. */
public class Controller {
    private final String name;
    private final Station station;
    private final SunriseExecutionService execution;
    private final IRequestService requests;

    public Controller(String name, Station station) {
        this.name = name;
        this.station = station;
        this.execution = new SunriseExecutionService(station);
        this.requests = new TorqueReferencing(station);
    }

    public String getName() {
        return name;
    }

    public RoboticsAPIContext getContext() {
        return station.context;
    }

    public Collection<Device> getDevices() {
        return Collections.<Device>singletonList(station.robot);
    }

    public void addControllerListener(IControllerStateListener listener) {
        station.safetyEvents.states.add(listener);
    }

    public void removeControllerListener(IControllerStateListener listener) {
        station.safetyEvents.states.remove(listener);
    }

    public IExecutionService getExecutionService() {
        return execution;
    }

    public IRequestService getRequestService() {
        return requests;
    }
}
