package com.kuka.roboticsAPI.motionModel;

/** Point to point, to the home position of the robot that it is commanded to. */
public class PTPHome extends SplineMotionJP<PTPHome> {
}
