package com.kuka.roboticsAPI.motionModel;

/** Former name of {@link HRCMotions}. */
public final class MMCMotions {
    private MMCMotions() {
    }

    public static HandGuidingMotion handGuiding() {
        return new HandGuidingMotion();
    }
}
