package com.kuka.connectivity.motionModel.directServo;

import com.kuka.connectivity.motionModel.smartServo.ServoMotionJP;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

/** Moves directly to each destination; destinations must be close and smooth. */
public class DirectServo extends ServoMotionJP<DirectServo> {
    private final JointPosition start;

    public DirectServo(JointPosition start) {
        this.start = new JointPosition(start);
    }

    @Override
    public IDirectServoRuntime getRuntime() {
        return running(true);
    }

    @Override
    public IDirectServoRuntime getRuntime(boolean waitForActivation) {
        return running(waitForActivation);
    }

    public JointPosition getStart() {
        return new JointPosition(start);
    }

    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        super.describe(order, motionFrame, robot);
        order.kind = MotionKind.DIRECT;
    }
}
