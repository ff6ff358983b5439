package com.kuka.connectivity.motionModel.directServo;

import com.kuka.connectivity.motionModel.smartServo.ServoMotionJP;
import com.kuka.roboticsAPI.deviceModel.JointPosition;

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
}
