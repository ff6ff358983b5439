package com.kuka.roboticsAPI.deviceModel;

import com.kuka.common.params.IParameterSet;
import com.kuka.roboticsAPI.geometricModel.redundancy.AbstractRedundancyCollection;

import heptarm.doubles.runtime.ParameterList;

/** Configuration for a pose: Status and Turn; -1: not given. */
public class StatusTurnRedundancy extends AbstractRedundancyCollection {
    private int status;
    private int turn;

    public StatusTurnRedundancy() {
    }

    public StatusTurnRedundancy(int status, int turn) {
        this.status = status;
        this.turn = turn;
    }

    public StatusTurnRedundancy setStatus(int value) {
        status = value;
        return this;
    }

    public StatusTurnRedundancy setTurn(int value) {
        turn = value;
        return this;
    }

    public int getStatus() {
        return status;
    }

    public int getTurn() {
        return turn;
    }

    @Override
    public IParameterSet getAllParameters() {
        return ParameterList.of("StatusTurnRedundancy", status, turn);
    }

    @Override
    public StatusTurnRedundancy copy() {
        return new StatusTurnRedundancy(status, turn);
    }

    @Override
    public String toString() {
        return "status " + status + ", turn " + turn;
    }
}
