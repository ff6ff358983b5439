package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

/** Point to point, to joint positions. */
public class PTP extends SplineMotionJP<PTP> {
    private final JointPosition destination;

    public PTP(JointPosition destination) {
        this.destination = new JointPosition(destination);
    }

    public JointPosition getDestination() {
        return new JointPosition(destination);
    }

    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.PTP;
        order.joints = destination.get();
    }
}
