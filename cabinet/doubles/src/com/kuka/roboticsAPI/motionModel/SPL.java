package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

/** Curved segment of a spline, to a frame. */
public class SPL extends SplineMotionCP<SPL> {
    private final AbstractFrame destination;

    public SPL(AbstractFrame destination) {
        this.destination = destination;
    }

    public AbstractFrame getDestination() {
        return destination;
    }

    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.SPL;
        MotionTranslator.target(order, destination, robot);
    }
}
