package com.kuka.roboticsAPI.deviceModel;

/** Operation mode of the cabinet. */
public enum OperationMode {
    T1, T2, AUT;

    public boolean isModeAuto() {
        return this == AUT;
    }
}
