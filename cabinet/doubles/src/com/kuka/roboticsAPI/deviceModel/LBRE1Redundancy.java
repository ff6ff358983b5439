package com.kuka.roboticsAPI.deviceModel;

import com.kuka.common.params.IParameterSet;

import heptarm.doubles.runtime.ParameterList;

/** Redundancy of an LBR: E1, which is the angle of A3 [rad], Status and Turn. */
public class LBRE1Redundancy extends StatusTurnRedundancy {
    private double e1;

    public LBRE1Redundancy() {
    }

    public LBRE1Redundancy(double e1, int status, int turn) {
        super(status, turn);
        this.e1 = e1;
    }

    public LBRE1Redundancy setE1(double value) {
        e1 = value;
        return this;
    }

    @Override
    public LBRE1Redundancy setStatus(int value) {
        super.setStatus(value);
        return this;
    }

    @Override
    public LBRE1Redundancy setTurn(int value) {
        super.setTurn(value);
        return this;
    }

    public double getE1() {
        return e1;
    }

    @Override
    public IParameterSet getAllParameters() {
        return ParameterList.of("LBRE1Redundancy", getStatus(), getTurn(), e1);
    }

    @Override
    public LBRE1Redundancy copy() {
        return new LBRE1Redundancy(e1, getStatus(), getTurn());
    }

    @Override
    public String toString() {
        return "E1 " + e1 + ", " + super.toString();
    }
}
