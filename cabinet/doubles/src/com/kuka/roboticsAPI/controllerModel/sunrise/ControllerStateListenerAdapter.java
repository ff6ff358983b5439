package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.DispatchedEventData;
import com.kuka.roboticsAPI.controllerModel.StatePortData;
import com.kuka.roboticsAPI.deviceModel.Device;

/** An empty listener to extend. */
public class ControllerStateListenerAdapter implements ISunriseControllerStateListener {
    @Override
    public void onSafetyStateChanged(Device device, SunriseSafetyState safetyState) {
    }

    @Override
    public void onIsReadyToMoveChanged(Device device, boolean isReadyToMove) {
    }

    @Override
    public void onStatePortChangeReceived(Controller controller, StatePortData data) {
    }

    @Override
    public void onFieldBusDeviceConfigurationChangeReceived(String controllerName, DispatchedEventData data) {
    }

    @Override
    public void onFieldBusDeviceIdentificationRequestReceived(String controllerName, DispatchedEventData data) {
    }

    @Override
    public void onShutdown(Controller controller) {
    }

    @Override
    public void onConnectionLost(Controller controller) {
    }
}
