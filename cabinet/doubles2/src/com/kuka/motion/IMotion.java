package com.kuka.motion;

/** A motion. */
public interface IMotion {
    heptarm.sunrise1.roboticsAPI.motionModel.IMotion behind();
}
