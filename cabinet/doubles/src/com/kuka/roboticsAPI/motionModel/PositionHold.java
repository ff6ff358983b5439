package com.kuka.roboticsAPI.motionModel;

import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** Holds the position for a time; -1: until cancelled. */
public class PositionHold extends RobotMotion<PositionHold> {
    private final double seconds;

    public PositionHold(IMotionControlMode mode, long duration, TimeUnit unit) {
        if (duration == 0 || duration < -1) {
            throw new IllegalArgumentException("duration must be positive, or -1 for no end, got " + duration + " s");
        }
        seconds = duration < 0 ? Double.NaN : unit.toNanos(duration) * 1e-9;
        setMode(mode);
    }

    /** Duration [s]; NaN: until cancelled; for the simulation. */
    public double seconds() {
        return seconds;
    }
}
