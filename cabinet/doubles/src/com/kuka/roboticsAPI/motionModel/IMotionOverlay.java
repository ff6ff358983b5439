package com.kuka.roboticsAPI.motionModel;

/** Changes a motion while it runs. */
public interface IMotionOverlay {
}
