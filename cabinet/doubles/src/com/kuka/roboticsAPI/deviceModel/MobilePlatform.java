package com.kuka.roboticsAPI.deviceModel;

import com.kuka.roboticsAPI.controllerModel.Controller;

/** A mobile platform; only the name is known, so that applications that name it compile. */
public abstract class MobilePlatform extends Device {
    protected MobilePlatform(String name, Controller controller) {
        super(name, controller);
    }
}
