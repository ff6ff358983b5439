package com.kuka.roboticsAPI.motionModel;

/** The name that {@link HRCMotions} had before. */
public final class MMCMotions {
    private MMCMotions() {
    }

    public static HandGuidingMotion handGuiding() {
        return new HandGuidingMotion();
    }
}
