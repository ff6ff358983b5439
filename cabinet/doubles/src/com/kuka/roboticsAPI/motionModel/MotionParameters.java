package com.kuka.roboticsAPI.motionModel;

import java.util.Arrays;

/** A motion's parameters at one time, to be printed; NaN where nothing was set. */
public final class MotionParameters {
    private final RobotMotion<?> motion;
    private final double[] relative;
    private final double[] blending;

    MotionParameters(RobotMotion<?> motion) {
        this.motion = motion;
        relative = motion.relativeParameters();
        blending = motion.blendingParameters();
    }

    @Override
    public String toString() {
        String cartesian = motion instanceof SplineMotionCP
                ? ", Cartesian " + Arrays.toString(((SplineMotionCP<?>) motion).cartesianParameters()) : "";
        return motion.getClass().getSimpleName() + ", joints " + Arrays.toString(relative) + ", blending "
                + Arrays.toString(blending) + cartesian;
    }
}
