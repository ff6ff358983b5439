package com.kuka.roboticsAPI.controllerModel.sunrise.positionMastering;

/** Whether axes are mastered with a tool. */
public class MasteringInfo {
    private final PositionMastering mastering;

    MasteringInfo(PositionMastering mastering) {
        this.mastering = mastering;
    }

    /** Of an axis, from 0. */
    public boolean getMasteringState(int axis) {
        return mastering.isAxisMastered(axis);
    }
}
