package com.kuka.roboticsAPI.deviceModel;

import com.kuka.roboticsAPI.controllerModel.Controller;

/** A robot. */
public abstract class Robot extends Device {
    protected Robot(String name, Controller controller) {
        super(name, controller);
    }
}
