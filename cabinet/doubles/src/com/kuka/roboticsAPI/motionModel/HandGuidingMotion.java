package com.kuka.roboticsAPI.motionModel;

import java.util.Arrays;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.HandGuide;
import heptarm.doubles.seam.PlantMotion;

/** Hand guiding while the enabling switch of the hand guiding device is held; ends when it is released. */
public class HandGuidingMotion extends RobotMotion<HandGuidingMotion> {
    private static final int AXES = 7;
    private static final double MM = 1e-3;

    private double[] lowest = every(-Math.PI);
    private double[] highest = every(Math.PI);
    private boolean[] enabled = new boolean[AXES];
    private boolean freezes = true;
    private boolean pulls;
    private double jointVelocity = Double.NaN;
    private double cartesianVelocity = Double.NaN;

    private static double[] every(double value) {
        double[] result = new double[AXES];
        Arrays.fill(result, value);
        return result;
    }

    private static double[] seven(String name, double[] radians) {
        if (radians.length != AXES) {
            throw new IllegalArgumentException(name + " must have " + AXES + " values, got " + radians.length);
        }
        for (double value : radians) {
            if (Double.isNaN(value) || Double.isInfinite(value)) {
                throw new IllegalArgumentException(name + " must be finite, got " + value);
            }
        }
        return radians.clone();
    }

    /** Upper limits [rad] of the axes whose limits are enabled. */
    public HandGuidingMotion setJointLimitsMax(double... radians) {
        highest = seven("jointLimitsMax", radians);
        return this;
    }

    /** Lower limits [rad]. */
    public HandGuidingMotion setJointLimitsMin(double... radians) {
        lowest = seven("jointLimitsMin", radians);
        return this;
    }

    /** Which axes have limits of their own. */
    public HandGuidingMotion setJointLimitsEnabled(boolean... axes) {
        if (axes.length != AXES) {
            throw new IllegalArgumentException("jointLimitsEnabled must have " + AXES + " values, got " + axes.length);
        }
        enabled = axes.clone();
        return this;
    }

    /** Whether at a limit every axis stops until the switch is released, or only the axis at its limit. */
    public HandGuidingMotion setJointLimitViolationFreezesAll(boolean all) {
        freezes = all;
        return this;
    }

    /** Whether an axis that starts beyond its limit is pulled back, or can only be guided back. */
    public HandGuidingMotion setPermanentPullOnViolationAtStart(boolean pull) {
        pulls = pull;
        return this;
    }

    /** Velocity limit of each axis [rad/s]. */
    public HandGuidingMotion setJointVelocityLimit(double radiansPerSecond) {
        jointVelocity = positive("jointVelocityLimit", radiansPerSecond);
        return this;
    }

    /** Velocity limit of the motion frame [mm/s]. */
    public HandGuidingMotion setCartVelocityLimit(double millimetresPerSecond) {
        cartesianVelocity = positive("cartVelocityLimit", millimetresPerSecond);
        return this;
    }

    /** The older name of {@link #setJointVelocityLimit}. */
    public HandGuidingMotion setAxisSpeedLimit(double radiansPerSecond) {
        return setJointVelocityLimit(radiansPerSecond);
    }

    /** Former name of {@link #setJointLimitsMax}. */
    public HandGuidingMotion setAxisLimitsMax(double... radians) {
        return setJointLimitsMax(radians);
    }

    /** Former name of {@link #setJointLimitsMin}. */
    public HandGuidingMotion setAxisLimitsMin(double... radians) {
        return setJointLimitsMin(radians);
    }

    /** Former name of {@link #setJointLimitsEnabled}. */
    public HandGuidingMotion setAxisLimitsEnabled(boolean... axes) {
        return setJointLimitsEnabled(axes);
    }

    /** Former name of {@link #setJointLimitViolationFreezesAll}. */
    public HandGuidingMotion setAxisLimitViolationFreezesAll(boolean all) {
        return setJointLimitViolationFreezesAll(all);
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        HandGuide motion = new HandGuide();
        for (int i = 0; i < AXES; i++) {
            if (enabled[i] && !(lowest[i] < highest[i])) {
                throw new IllegalArgumentException("the lower limit of A" + (i + 1) + " must be below the upper limit, got "
                        + lowest[i] + " and " + highest[i] + " rad");
            }
            motion.qMin[i] = enabled[i] ? lowest[i] : Double.NaN;
            motion.qMax[i] = enabled[i] ? highest[i] : Double.NaN;
        }
        motion.jointVelocity = jointVelocity;
        motion.cartesianVelocity = MM * cartesianVelocity;
        motion.freezesAll = freezes;
        motion.pullsBack = pulls;
        return motion;
    }
}
