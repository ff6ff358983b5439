package com.kuka.roboticsAPI.motionModel;

import java.util.List;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;

/** Base of motions; {@code T} is the motion's own type, so that setters chain. */
public abstract class Motion<T extends Motion<T>> implements IMotion {
    @SuppressWarnings("unchecked")
    protected final T self() {
        return (T) this;
    }

    /** Its kind, for the log of an application. */
    @Override
    public String toString() {
        return getClass().getSimpleName();
    }

    /** This motion in the plant's terms, in SI; for the simulation. */
    public PlantMotion describe(MotionTranslator to) {
        throw new IllegalArgumentException("the virtual cabinet cannot execute a motion of class " + getClass().getName());
    }

    /** Motions of a batch, segments of a spline; none of others; for the simulation. */
    public List<? extends RobotMotion<?>> parts() {
        return List.of();
    }
}
