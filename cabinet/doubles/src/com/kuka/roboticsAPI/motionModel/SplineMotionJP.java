package com.kuka.roboticsAPI.motionModel;

/** A motion planned in joint space. */
public abstract class SplineMotionJP<T extends SplineMotionJP<T>> extends RobotMotion<T> {
}
