package com.kuka.roboticsAPI.motionModel;

import heptarm.doubles.seam.CartesianDynamics;
import heptarm.doubles.seam.Orientation;
import heptarm.doubles.seam.OrientationReference;
import heptarm.doubles.seam.OrientationType;

/** A motion planned in Cartesian space. */
public abstract class SplineMotionCP<T extends SplineMotionCP<T>> extends RobotMotion<T> {
    private static final double MM = 1e-3;

    private final CartesianDynamics dynamics = new CartesianDynamics();
    private SplineOrientationType type;
    private OrientationReferenceSystem reference;

    public T setCartVelocity(double mmPerSecond) {
        dynamics.velocity = MM * positive("cartVelocity", mmPerSecond);
        return self();
    }

    public T setCartAcceleration(double value) {
        dynamics.acceleration = MM * positive("cartAcceleration", value);
        return self();
    }

    public T setCartJerk(double value) {
        dynamics.jerk = MM * positive("cartJerk", value);
        return self();
    }

    public T setOrientationVelocity(double radPerSecond) {
        dynamics.orientationVelocity = positive("orientationVelocity", radPerSecond);
        return self();
    }

    public T setOrientationAcceleration(double value) {
        dynamics.orientationAcceleration = positive("orientationAcceleration", value);
        return self();
    }

    public T setOrientationJerk(double value) {
        dynamics.orientationJerk = positive("orientationJerk", value);
        return self();
    }

    public T setOrientationType(SplineOrientationType value) {
        type = value;
        return self();
    }

    public T setOrientationReferenceSystem(OrientationReferenceSystem value) {
        reference = value;
        return self();
    }

    /** For the simulation. */
    public CartesianDynamics cartesianDynamics() {
        return dynamics;
    }

    /** For the simulation. */
    public Orientation orientation() {
        Orientation orientation = new Orientation();
        orientation.type = type == null ? null : switch (type) {
            case Variable -> OrientationType.VARIABLE;
            case Constant -> OrientationType.CONSTANT;
            case Ignore -> OrientationType.IGNORE;
            case OriJoint -> OrientationType.JOINT;
        };
        orientation.reference = reference == null ? null
                : reference == OrientationReferenceSystem.Path ? OrientationReference.PATH : OrientationReference.BASE;
        return orientation;
    }
}
