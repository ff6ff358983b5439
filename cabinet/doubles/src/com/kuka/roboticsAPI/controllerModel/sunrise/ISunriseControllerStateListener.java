package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.DispatchedEventData;
import com.kuka.roboticsAPI.controllerModel.IControllerStateListener;
import com.kuka.roboticsAPI.controllerModel.StatePortData;
import com.kuka.roboticsAPI.deviceModel.Device;

/** Called when the safety state, readiness or a field bus changes. */
public interface ISunriseControllerStateListener extends IControllerStateListener {
    void onSafetyStateChanged(Device device, SunriseSafetyState safetyState);

    void onIsReadyToMoveChanged(Device device, boolean isReadyToMove);

    default void onStatePortChangeReceived(Controller controller, StatePortData data) {
    }

    /** Its former name. */
    default void statePortChanged(Controller controller, StatePortData data) {
    }

    void onFieldBusDeviceConfigurationChangeReceived(String controllerName, DispatchedEventData data);

    void onFieldBusDeviceIdentificationRequestReceived(String controllerName, DispatchedEventData data);
}
