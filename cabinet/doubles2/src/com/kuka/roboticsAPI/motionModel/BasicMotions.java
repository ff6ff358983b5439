package com.kuka.roboticsAPI.motionModel;

import java.util.concurrent.TimeUnit;

import com.kuka.device.common.JointPosition;
import com.kuka.geometry.Frame;
import com.kuka.math.geometry.Transformation;
import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;

import heptarm.doubles2.Behind;
import heptarm.doubles2.Motion;

/** Makes motions. */
public final class BasicMotions {
    private BasicMotions() {
    }

    public static Motion ptp(JointPosition target) {
        return new Motion(heptarm.sunrise1.roboticsAPI.motionModel.BasicMotions.ptp(target.toArray()));
    }

    public static Motion ptp(Frame target) {
        return new Motion(heptarm.sunrise1.roboticsAPI.motionModel.BasicMotions.ptp(Behind.frame(target)));
    }

    public static Motion linRel(Transformation offset) {
        return new Motion(heptarm.sunrise1.roboticsAPI.motionModel.BasicMotions.linRel(Behind.transformation(offset)));
    }

    public static PositionHold positionHold(AbstractMotionControlMode mode, long duration, TimeUnit unit) {
        return new PositionHold(mode, duration, unit);
    }
}
