package com.kuka.roboticsAPI.motionModel;

/** A motion. */
public interface IMotion {
}
