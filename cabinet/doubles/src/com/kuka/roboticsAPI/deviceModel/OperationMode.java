package com.kuka.roboticsAPI.deviceModel;

/** Operation mode of the cabinet; the simulated one is never in CRR and KRF. */
public enum OperationMode {
    T1, T2, AUT, CRR, KRF;

    public boolean isModeAuto() {
        return this == AUT;
    }
}
