package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.runtime.Station;

/** The robot of a cabinet. */
public class SunriseLBR extends LBR {
    /** Created by the simulation. */
    public SunriseLBR(String name, Controller controller, Station station) {
        super(name, controller, station);
    }
}
