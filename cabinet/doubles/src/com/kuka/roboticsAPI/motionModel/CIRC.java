package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

/** Arc of a circle through an auxiliary point. */
public class CIRC extends SplineMotionCP<CIRC> {
    private final AbstractFrame auxiliary;
    private final AbstractFrame destination;

    public CIRC(AbstractFrame auxiliary, AbstractFrame destination) {
        this.auxiliary = auxiliary;
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }

    /** The auxiliary point; for the simulation. */
    public AbstractFrame auxiliary() {
        return auxiliary;
    }
}
