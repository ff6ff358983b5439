package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

/** Straight line to a frame. */
public class LIN extends SplineMotionCP<LIN> {
    private final AbstractFrame destination;

    public LIN(AbstractFrame destination) {
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }

    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.LIN;
        MotionTranslator.target(order, destination, robot);
    }
}
