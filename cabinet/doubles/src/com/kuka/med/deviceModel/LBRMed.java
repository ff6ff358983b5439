package com.kuka.med.deviceModel;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseLBR;

import heptarm.doubles.runtime.Station;

/** An LBR Med; applications that use nothing but the calls of the LBR run. */
public class LBRMed extends SunriseLBR {
    /** Created by the simulation. */
    public LBRMed(String name, Controller controller, Station station) {
        super(name, controller, station);
    }
}
