package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.deviceModel.OperationMode;

import heptarm.doubles.seam.SafetyFlags;

/** A snapshot of the safety state. */
public final class SunriseSafetyState implements ISafetyState {
    /** Emergency stop. */
    public enum EmergencyStop { ACTIVE, INACTIVE }

    /** Kind of stop requested by the safety controller. */
    public enum SafetyStopType {
        NOSTOP, STOP0, STOP1, STOP2;

        public int toInt() {
            return ordinal();
        }
    }

    /** Operator safety. */
    public enum OperatorSafety { OPERATOR_SAFETY_CLOSED, OPERATOR_SAFETY_OPEN }

    /** Enabling device. */
    public enum EnablingDeviceState { NONE, NORMAL, HANDGUIDING }

    private final long flags;
    private final OperationMode mode;

    public SunriseSafetyState(long flags, OperationMode mode) {
        this.flags = flags;
        this.mode = mode;
    }

    private boolean has(int bit) {
        return (flags & bit) != 0;
    }

    @Override
    public EmergencyStop getEmergencyStopInt() {
        return has(SafetyFlags.EMERGENCY_STOP) ? EmergencyStop.ACTIVE : EmergencyStop.INACTIVE;
    }

    @Override
    public EmergencyStop getEmergencyStopEx() {
        return has(SafetyFlags.EXTERNAL_STOP) ? EmergencyStop.ACTIVE : EmergencyStop.INACTIVE;
    }

    @Override
    public SafetyStopType getSafetyStopSignal() {
        if (has(SafetyFlags.DRIVE_ERROR)) {
            return SafetyStopType.STOP0;
        }
        return has(SafetyFlags.PROTECTIVE_STOP) ? SafetyStopType.STOP1 : SafetyStopType.NOSTOP;
    }

    @Override
    public OperatorSafety getOperatorSafetyState() {
        return has(SafetyFlags.SAFEGUARD_OPEN) ? OperatorSafety.OPERATOR_SAFETY_OPEN : OperatorSafety.OPERATOR_SAFETY_CLOSED;
    }

    @Override
    public EnablingDeviceState getEnablingDeviceState() {
        if (has(SafetyFlags.HAND_GUIDING)) {
            return EnablingDeviceState.HANDGUIDING;
        }
        return has(SafetyFlags.ENABLED) ? EnablingDeviceState.NORMAL : EnablingDeviceState.NONE;
    }

    @Override
    public OperationMode getOperationMode() {
        return mode;
    }

    @Override
    public boolean areAllAxesGMSReferenced() {
        return has(SafetyFlags.MASTERED);
    }

    @Override
    public boolean areAllAxesPositionReferenced() {
        return has(SafetyFlags.MASTERED);
    }
}
