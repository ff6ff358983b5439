package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

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

    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.CIRC;
        order.via = MotionTranslator.pose(auxiliary.transformationFromWorld());
        MotionTranslator.target(order, destination, robot);
    }
}
