package com.kuka.roboticsAPI.motionModel;

import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** Holds the position for a time; -1: until it is cancelled; 0: it ends at once. */
public class PositionHold extends RobotMotion<PositionHold> {
    /** One cycle of the controller [s]. */
    private static final double SHORTEST = 1e-3;

    private final double seconds;

    public PositionHold(IMotionControlMode mode, long duration, TimeUnit unit) {
        if (duration < -1) {
            throw new IllegalArgumentException("duration must not be negative, or -1 for ever, got " + duration);
        }
        seconds = duration < 0 ? Double.NaN : duration == 0 ? SHORTEST : unit.toNanos(duration) * 1e-9;
        setMode(mode);
    }

    /** Duration [s]; NaN: until cancelled; for the simulation. */
    public double seconds() {
        return seconds;
    }
}
