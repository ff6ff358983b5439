package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

/** Straight line to a frame. */
public class LIN extends SplineMotionCP<LIN> {
    private final AbstractFrame destination;

    public LIN(AbstractFrame destination) {
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }
}
