package com.kuka.roboticsAPI.controllerModel;

/** Called on changes of a controller. */
public interface IControllerStateListener {
    void onShutdown(Controller controller);

    void onConnectionLost(Controller controller);
}
