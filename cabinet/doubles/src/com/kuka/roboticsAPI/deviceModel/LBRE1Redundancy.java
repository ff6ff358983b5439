package com.kuka.roboticsAPI.deviceModel;

import com.kuka.roboticsAPI.geometricModel.redundancy.IRedundancyCollection;

/** Redundancy of an LBR: arm angle E1 [rad], status and turn bits. */
public class LBRE1Redundancy implements IRedundancyCollection {
    private double e1;
    private int status;
    private int turn;

    public LBRE1Redundancy() {
    }

    public LBRE1Redundancy(double e1, int status, int turn) {
        this.e1 = e1;
        this.status = status;
        this.turn = turn;
    }

    public LBRE1Redundancy setE1(double value) {
        e1 = value;
        return this;
    }

    public LBRE1Redundancy setStatus(int value) {
        status = value;
        return this;
    }

    public LBRE1Redundancy setTurn(int value) {
        turn = value;
        return this;
    }

    public double getE1() {
        return e1;
    }

    public int getStatus() {
        return status;
    }

    public int getTurn() {
        return turn;
    }
}
