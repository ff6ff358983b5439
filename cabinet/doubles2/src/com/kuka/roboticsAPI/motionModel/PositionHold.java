package com.kuka.roboticsAPI.motionModel;

import java.util.concurrent.TimeUnit;

import com.kuka.motion.IMotion;
import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;

import heptarm.doubles2.IMotionOverlay;

/** Holds the position. */
public final class PositionHold implements IMotion {
    private final heptarm.sunrise1.roboticsAPI.motionModel.PositionHold behind;

    public PositionHold(AbstractMotionControlMode mode, long duration, TimeUnit unit) {
        behind = new heptarm.sunrise1.roboticsAPI.motionModel.PositionHold(mode.behind(), duration, unit);
    }

    @Override
    public heptarm.sunrise1.roboticsAPI.motionModel.IMotion behind() {
        return behind;
    }

    public PositionHold addMotionOverlay(IMotionOverlay overlay) {
        behind.addMotionOverlay(overlay.behind());
        return this;
    }
}
