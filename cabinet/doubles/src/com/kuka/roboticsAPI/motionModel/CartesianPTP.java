package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

/** Point to point, to a frame. */
public class CartesianPTP extends SplineMotionJP<CartesianPTP> {
    private final AbstractFrame destination;

    public CartesianPTP(AbstractFrame destination) {
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }
}
