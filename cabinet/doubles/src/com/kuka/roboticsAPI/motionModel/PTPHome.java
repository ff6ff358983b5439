package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;
import heptarm.doubles.seam.Ptp;
import heptarm.doubles.seam.PtpPose;

/** Point to point, to the home position of the commanded robot. */
public class PTPHome extends SplineMotionJP<PTPHome> {
    @Override
    public PlantMotion describe(MotionTranslator to) {
        if (to.robot().home() instanceof AbstractFrame) {
            AbstractFrame home = (AbstractFrame) to.robot().home();
            PtpPose motion = new PtpPose();
            motion.target = to.pose(home);
            motion.redundancy = to.redundancy(home);
            motion.dynamics = jointDynamics();
            motion.blending = blending();
            return motion;
        }
        Ptp motion = new Ptp();
        motion.q = ((JointPosition) to.robot().home()).get();
        motion.dynamics = jointDynamics();
        motion.blending = blending();
        return motion;
    }
}
