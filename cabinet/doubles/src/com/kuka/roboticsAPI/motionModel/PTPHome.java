package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

/** Point to point, to the home position of the commanded robot. */
public class PTPHome extends SplineMotionJP<PTPHome> {
    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.PTP;
        if (robot.home() instanceof JointPosition) {
            order.joints = ((JointPosition) robot.home()).get();
        } else {
            MotionTranslator.target(order, (AbstractFrame) robot.home(), robot);
        }
    }
}
