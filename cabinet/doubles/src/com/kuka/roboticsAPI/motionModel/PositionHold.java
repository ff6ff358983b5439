package com.kuka.roboticsAPI.motionModel;

import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.Hold;
import heptarm.doubles.seam.PlantMotion;

/** Holds the position for a time; -1: until cancelled; 0: it ends at once. */
public class PositionHold extends RobotMotion<PositionHold> {
    /** One cycle of the controller [s]. */
    private static final double SHORTEST = 1e-3;

    /** NaN: until cancelled [s]. */
    private final double seconds;

    public PositionHold(IMotionControlMode mode, long duration, TimeUnit unit) {
        if (duration < -1) {
            throw new IllegalArgumentException("duration must be 0 or positive, or -1 for no end, got " + duration);
        }
        seconds = duration < 0 ? Double.NaN : duration == 0 ? SHORTEST : unit.toNanos(duration) * 1e-9;
        setMode(mode);
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        Hold motion = new Hold();
        motion.duration = seconds;
        return motion;
    }
}
