package com.kuka.roboticsAPI.motionModel;

import java.util.Arrays;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.ITriggerAction;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** A motion of a robot with the parameters that all of them share. */
public abstract class RobotMotion<T extends RobotMotion<T>> extends Motion<T> {
    private static final int AXES = 7;

    private final double[] relative = new double[3 * AXES];
    private final double[] blending = {Double.NaN, Double.NaN, Double.NaN};
    private IMotionControlMode mode;
    private IMotionOverlay overlay;
    private final List<ICondition> breaks = new CopyOnWriteArrayList<>();
    private final List<ICondition> triggers = new CopyOnWriteArrayList<>();
    private final List<ITriggerAction> actions = new CopyOnWriteArrayList<>();

    protected RobotMotion() {
        Arrays.fill(relative, Double.NaN);
    }

    private T setRelative(int block, String name, double[] values) {
        if (values.length != 1 && values.length != AXES) {
            throw new IllegalArgumentException(name + " takes one value or " + AXES + ", not " + values.length);
        }
        for (double value : values) {
            if (!(value > 0.0 && value <= 1.0)) {
                throw new IllegalArgumentException(name + " is " + value + "; it has to be in (0, 1]");
            }
        }
        for (int i = 0; i < AXES; i++) {
            relative[block * AXES + i] = values.length == 1 ? values[0] : values[i];
        }
        return self();
    }

    public T setJointVelocityRel(double... values) {
        return setRelative(0, "jointVelocityRel", values);
    }

    public T setJointAccelerationRel(double... values) {
        return setRelative(1, "jointAccelerationRel", values);
    }

    public T setJointJerkRel(double... values) {
        return setRelative(2, "jointJerkRel", values);
    }

    public T setBlendingRel(double value) {
        if (!(value >= 0.0 && value <= 1.0)) {
            throw new IllegalArgumentException("blendingRel is " + value + "; it has to be in [0, 1]");
        }
        blending[0] = value;
        return self();
    }

    public T setBlendingCart(double millimetres) {
        blending[1] = notNegative("blendingCart", millimetres);
        return self();
    }

    public T setBlendingOri(double radians) {
        blending[2] = notNegative("blendingOri", radians);
        return self();
    }

    public T setMode(IMotionControlMode value) {
        mode = value;
        return self();
    }

    /** Ends the motion when a condition holds; several: when one of them does. */
    public T breakWhen(ICondition condition) {
        breaks.add(condition);
        return self();
    }

    /** Does something when a condition holds for the first time; the motion goes on. */
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

    /** What a trigger does; for the simulation. */
    public ITriggerAction action(int trigger) {
        return actions.get(trigger);
    }

    public T addMotionOverlay(IMotionOverlay added) {
        overlay = added;
        return self();
    }

    /** What changes the motion while it runs; null: nothing; for the simulation. */
    public IMotionOverlay overlay() {
        return overlay;
    }

    /** What is set now, to be printed. */
    public MotionParameters getParams() {
        return new MotionParameters(this);
    }

    public IMotionControlMode getMode() {
        return mode;
    }

    /** Velocity, acceleration and jerk of each axis as fractions, 21 numbers, NaN where nothing was set; for the simulation. */
    public double[] relativeParameters() {
        return relative.clone();
    }

    /** Blending: relative, millimetres, radians; NaN where nothing was set; for the simulation. */
    public double[] blendingParameters() {
        return blending.clone();
    }

    protected static double notNegative(String name, double value) {
        if (!(value >= 0.0) || Double.isInfinite(value)) {
            throw new IllegalArgumentException(name + " is " + value + "; it must not be negative");
        }
        return value;
    }

    protected static double positive(String name, double value) {
        if (!(value > 0.0) || Double.isInfinite(value)) {
            throw new IllegalArgumentException(name + " is " + value + "; it has to be positive");
        }
        return value;
    }
}
