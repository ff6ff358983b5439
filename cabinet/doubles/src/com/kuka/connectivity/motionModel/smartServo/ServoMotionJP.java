package com.kuka.connectivity.motionModel.smartServo;

/** A servo motion of the joints. */
public abstract class ServoMotionJP<T extends ServoMotionJP<T>> extends ServoMotion<T> {
}
