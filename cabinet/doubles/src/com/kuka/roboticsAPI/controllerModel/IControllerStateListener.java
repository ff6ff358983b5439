package com.kuka.roboticsAPI.controllerModel;

/** Hears of a controller. */
public interface IControllerStateListener {
    void onShutdown(Controller controller);

    void onConnectionLost(Controller controller);
}
