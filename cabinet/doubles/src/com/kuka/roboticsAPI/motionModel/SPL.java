package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

/** Curved segment of a spline, to a frame. */
public class SPL extends SplineMotionCP<SPL> {
    private final AbstractFrame destination;

    public SPL(AbstractFrame destination) {
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }
}
