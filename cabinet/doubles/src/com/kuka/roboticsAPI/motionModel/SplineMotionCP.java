package com.kuka.roboticsAPI.motionModel;

import java.util.Arrays;

/** A motion planned in space. */
public abstract class SplineMotionCP<T extends SplineMotionCP<T>> extends RobotMotion<T> {
    private final double[] cartesian = new double[6];
    private SplineOrientationType type;
    private OrientationReferenceSystem reference;

    protected SplineMotionCP() {
        Arrays.fill(cartesian, Double.NaN);
    }

    private T set(int index, String name, double value) {
        cartesian[index] = positive(name, value);
        return self();
    }

    public T setCartVelocity(double mmPerSecond) {
        return set(0, "cartVelocity", mmPerSecond);
    }

    public T setCartAcceleration(double value) {
        return set(1, "cartAcceleration", value);
    }

    public T setCartJerk(double value) {
        return set(2, "cartJerk", value);
    }

    public T setOrientationVelocity(double radPerSecond) {
        return set(3, "orientationVelocity", radPerSecond);
    }

    public T setOrientationAcceleration(double value) {
        return set(4, "orientationAcceleration", value);
    }

    public T setOrientationJerk(double value) {
        return set(5, "orientationJerk", value);
    }

    public T setOrientationType(SplineOrientationType value) {
        type = value;
        return self();
    }

    public T setOrientationReferenceSystem(OrientationReferenceSystem value) {
        reference = value;
        return self();
    }

    /** Type and reference of the orientation as their ordinals, -1 where nothing was set; for the simulation. */
    public int[] orientationParameters() {
        return new int[] {type == null ? -1 : type.ordinal(), reference == null ? -1 : reference.ordinal()};
    }

    /** Velocity, acceleration, jerk in mm, then in rad; NaN where nothing was set; for the simulation. */
    public double[] cartesianParameters() {
        return cartesian.clone();
    }
}
