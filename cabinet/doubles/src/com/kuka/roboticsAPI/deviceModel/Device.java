package com.kuka.roboticsAPI.deviceModel;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;

/** A device of a controller. */
public abstract class Device extends PhysicalObject {
    private final Controller controller;

    protected Device(String name, Controller controller) {
        super(name);
        this.controller = controller;
    }

    public Controller getController() {
        return controller;
    }
}
