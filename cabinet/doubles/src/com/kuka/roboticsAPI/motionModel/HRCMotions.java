package com.kuka.roboticsAPI.motionModel;

/** Creates motions in which a person and the robot work together. */
public final class HRCMotions {
    private HRCMotions() {
    }

    public static HandGuidingMotion handGuiding() {
        return new HandGuidingMotion();
    }
}
