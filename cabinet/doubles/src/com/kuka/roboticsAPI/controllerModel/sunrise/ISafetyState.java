package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.deviceModel.OperationMode;

/** Safety state reported by the safety controller. */
public interface ISafetyState {
    SunriseSafetyState.EmergencyStop getEmergencyStopInt();

    SunriseSafetyState.EmergencyStop getEmergencyStopEx();

    SunriseSafetyState.SafetyStopType getSafetyStopSignal();

    SunriseSafetyState.OperatorSafety getOperatorSafetyState();

    SunriseSafetyState.EnablingDeviceState getEnablingDeviceState();

    OperationMode getOperationMode();

    boolean areAllAxesGMSReferenced();

    boolean areAllAxesPositionReferenced();
}
