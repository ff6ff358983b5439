package com.kuka.roboticsAPI.deviceModel;

import com.kuka.roboticsAPI.geometricModel.Frame;

/** Where a frame of a robot was at a moment, in the world. */
public class PositionInformation {
    private final Frame current;
    private final Frame commanded;

    /** Made by the simulation. */
    public PositionInformation(Frame current, Frame commanded) {
        this.current = current;
        this.commanded = commanded;
    }

    public Frame getCurrentCartesianPosition() {
        return current.copyWithRedundancy();
    }

    public Frame getCommandedCartesianPosition() {
        return commanded.copyWithRedundancy();
    }
}
