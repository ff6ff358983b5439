package com.kuka.roboticsAPI.motionModel;

/** Something that changes a motion while it runs. */
public interface IMotionOverlay {
}
