package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.JointPosition;

/** Point to point, to joint positions. */
public class PTP extends SplineMotionJP<PTP> {
    private final JointPosition destination;

    public PTP(JointPosition destination) {
        this.destination = new JointPosition(destination);
    }

    public JointPosition getDestination() {
        return new JointPosition(destination);
    }
}
