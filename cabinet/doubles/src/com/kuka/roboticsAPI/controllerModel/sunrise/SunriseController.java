package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.Controller;

import heptarm.doubles.runtime.Station;

/** The cabinet of an LBR. */
public class SunriseController extends Controller {
    private final Station station;

    public SunriseController(String name, Station station) {
        super(name, station);
        this.station = station;
    }

    /** Acknowledges errors whose cause is gone. */
    public void acknowledgeError() {
        station.plant.acknowledge();
    }
}
