package com.kuka.connectivity.motionModel.smartServo;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

/** Plans a limited trajectory to each destination, far or near. The start position must be the current one. */
public class SmartServo extends ServoMotionJP<SmartServo> {
    private final JointPosition start;

    public SmartServo(JointPosition start) {
        this.start = new JointPosition(start);
    }

    @Override
    public ISmartServoRuntime getRuntime() {
        return running(true);
    }

    @Override
    public ISmartServoRuntime getRuntime(boolean waitForActivation) {
        return running(waitForActivation);
    }

    public JointPosition getStart() {
        return new JointPosition(start);
    }

    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        super.describe(order, motionFrame, robot);
        order.kind = MotionKind.SERVO;
    }
}
