package com.kuka.roboticsAPI.motionModel;

import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.ITriggerAction;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

import heptarm.doubles.seam.Blending;
import heptarm.doubles.seam.JointDynamics;

/** A motion of a robot, with the parameters of all motions. */
public abstract class RobotMotion<T extends RobotMotion<T>> extends Motion<T> {
    private static final int AXES = 7;
    private static final double MM = 1e-3;

    private final JointDynamics dynamics = new JointDynamics();
    private final Blending blending = new Blending();
    private IMotionControlMode mode;
    private IMotionOverlay overlay;
    private final List<ICondition> breaks = new CopyOnWriteArrayList<>();
    private final List<ICondition> triggers = new CopyOnWriteArrayList<>();
    private final List<ITriggerAction> actions = new CopyOnWriteArrayList<>();

    private T setRelative(double[] into, String name, double[] values) {
        if (values.length != 1 && values.length != AXES) {
            throw new IllegalArgumentException(name + " must have 1 or " + AXES + " values, got " + values.length);
        }
        for (double value : values) {
            if (!(value > 0.0 && value <= 1.0)) {
                throw new IllegalArgumentException(name + " must be in (0, 1], got " + value);
            }
        }
        for (int i = 0; i < AXES; i++) {
            into[i] = values.length == 1 ? values[0] : values[i];
        }
        return self();
    }

    public T setJointVelocityRel(double... values) {
        return setRelative(dynamics.velocity, "jointVelocityRel", values);
    }

    public T setJointAccelerationRel(double... values) {
        return setRelative(dynamics.acceleration, "jointAccelerationRel", values);
    }

    public T setJointJerkRel(double... values) {
        return setRelative(dynamics.jerk, "jointJerkRel", values);
    }

    public T setBlendingRel(double value) {
        if (!(value >= 0.0 && value <= 1.0)) {
            throw new IllegalArgumentException("blendingRel must be in [0, 1], got " + value);
        }
        blending.relative = value;
        return self();
    }

    public T setBlendingCart(double millimetres) {
        blending.distance = MM * notNegative("blendingCart", millimetres);
        return self();
    }

    public T setBlendingOri(double radians) {
        blending.orientation = notNegative("blendingOri", radians);
        return self();
    }

    public T setMode(IMotionControlMode value) {
        mode = value;
        return self();
    }

    /** Ends the motion when a condition is met; of several conditions, when one is met. */
    public T breakWhen(ICondition condition) {
        breaks.add(condition);
        return self();
    }

    /** Executes an action when a condition is met for the first time; the motion continues. */
    public T triggerWhen(ICondition condition, ITriggerAction action) {
        triggers.add(condition);
        actions.add(action);
        return self();
    }

    /** For the simulation. */
    public List<ICondition> breakConditions() {
        return breaks;
    }

    /** Conditions of the triggers; for the simulation. */
    public List<ICondition> triggerConditions() {
        return triggers;
    }

    /** Action of a trigger; for the simulation. */
    public ITriggerAction action(int trigger) {
        return actions.get(trigger);
    }

    public T addMotionOverlay(IMotionOverlay added) {
        overlay = added;
        return self();
    }

    /** Overlay of the motion; null: none; for the simulation. */
    public IMotionOverlay overlay() {
        return overlay;
    }

    /** Current settings, to be printed. */
    public MotionParameters getParams() {
        return new MotionParameters(this);
    }

    public IMotionControlMode getMode() {
        return mode;
    }

    /** For the simulation. */
    public JointDynamics jointDynamics() {
        return dynamics;
    }

    /** For the simulation. */
    public Blending blending() {
        return blending;
    }

    protected static double notNegative(String name, double value) {
        if (!(value >= 0.0) || Double.isInfinite(value)) {
            throw new IllegalArgumentException(name + " must not be negative, got " + value);
        }
        return value;
    }

    protected static double positive(String name, double value) {
        if (!(value > 0.0) || Double.isInfinite(value)) {
            throw new IllegalArgumentException(name + " must be positive, got " + value);
        }
        return value;
    }
}
