package com.kuka.roboticsAPI.conditionModel;

import heptarm.doubles.Criterion;

/** A point on the path is reached: a distance [mm] from its start or, negative, before its destination; and a delay [ms]. */
public class MotionPathCondition extends Criterion {
    private final ReferenceType reference;
    private final double distance;
    private final long delay;

    public MotionPathCondition(ReferenceType reference, double distance, long delay) {
        if (!(reference == ReferenceType.START ? distance >= 0.0 : distance <= 0.0)) {
            throw new IllegalArgumentException("the point lies " + distance + " mm from " + reference + ", beyond the path");
        }
        this.reference = reference;
        this.distance = distance;
        this.delay = delay;
    }

    /** Reference, metres, seconds; for the simulation. */
    public double[] numbers() {
        return new double[] {reference.ordinal(), distance * 1e-3, delay * 1e-3};
    }
}
