package com.kuka.roboticsAPI.motionModel;

import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;

/** Holds the position for a time; -1: until cancelled. */
public class PositionHold extends RobotMotion<PositionHold> {
    /** NaN: until cancelled [s]. */
    private final double seconds;

    public PositionHold(IMotionControlMode mode, long duration, TimeUnit unit) {
        if (duration == 0 || duration < -1) {
            throw new IllegalArgumentException("duration must be positive, or -1 for no end, got " + duration + " s");
        }
        seconds = duration < 0 ? Double.NaN : unit.toNanos(duration) * 1e-9;
        setMode(mode);
    }

    @Override
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        order.kind = MotionKind.HOLD;
        order.duration = seconds;
    }
}
