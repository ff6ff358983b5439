package com.kuka.roboticsAPI.motionModel;

/** Point to point, to the home position of the commanded robot. */
public class PTPHome extends SplineMotionJP<PTPHome> {
}
