package com.kuka.roboticsAPI.deviceModel;

/** Operation mode of the cabinet; the simulated cabinet is never in CRR or KRF. */
public enum OperationMode {
    T1, T2, AUT, CRR, KRF;

    public boolean isModeAuto() {
        return this == AUT;
    }
}
