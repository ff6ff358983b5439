package com.kuka.roboticsAPI.motionModel.controlModeModel;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.motion.ControlModeTranslator;
import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.runtime.NotModelled;
import heptarm.doubles.seam.CartesianImpedance;
import heptarm.doubles.seam.ImpedanceMode;

/**
 * A spring and a damper between the motion frame and its set-point, and in the null space. Directions in the order
 * x y z a b c; [N/m], [Nm/rad], [N], [Nm], [mm], [rad].
 */
public class CartesianImpedanceControlMode extends AbstractMotionControlMode {
    static final int DIRECTIONS = 6;
    /** A limit of this size or above is no limit. */
    static final double OFF = 1e6;
    private static final double STIFFEST = 5000.0;
    private static final double STIFFEST_ROTATION = 300.0;
    /** Largest stiffness that the plant takes [Nm/rad]. */
    private static final double PLANT_NULL_SPACE_STIFFNESS = 5000.0;
    private static final double[] DEFAULT_STIFFNESS = {2000, 2000, 2000, 200, 200, 200};
    private static final double DEFAULT_DAMPING = 0.7;
    private static final double DEFAULT_NULL_SPACE_STIFFNESS = 100.0;
    private static final double LEAST_DAMPING = 0.1;
    private static final double LEAST_NULL_SPACE_DAMPING = 0.3;

    private final double[] stiffness = DEFAULT_STIFFNESS.clone();
    private final double[] damping = filled(DEFAULT_DAMPING);
    private final double[] additionalControlForce = new double[DIRECTIONS];
    private double[] maxControlForce = filled(OFF);
    private double[] maxCartesianVelocity = filled(OFF);
    private double[] maxPathDeviation = filled(OFF);
    private boolean stopsAtMaxControlForce;
    private double nullSpaceStiffness = DEFAULT_NULL_SPACE_STIFFNESS;
    private double nullSpaceDamping = DEFAULT_DAMPING;
    private AbstractFrame referenceSystem;

    public CartesianImpedanceControlMode() {
    }

    public CartesianImpedanceControlMode(CartesianImpedanceControlMode other) {
        System.arraycopy(other.stiffness, 0, stiffness, 0, DIRECTIONS);
        System.arraycopy(other.damping, 0, damping, 0, DIRECTIONS);
        System.arraycopy(other.additionalControlForce, 0, additionalControlForce, 0, DIRECTIONS);
        maxControlForce = other.maxControlForce;
        maxCartesianVelocity = other.maxCartesianVelocity;
        maxPathDeviation = other.maxPathDeviation;
        stopsAtMaxControlForce = other.stopsAtMaxControlForce;
        nullSpaceStiffness = other.nullSpaceStiffness;
        nullSpaceDamping = other.nullSpaceDamping;
        referenceSystem = other.referenceSystem;
    }

    /** Selects the directions whose parameters are set. */
    public static class CartImpBuilder {
        final int[] chosen;
        private final CartesianImpedanceControlMode mode;

        CartImpBuilder(CartesianImpedanceControlMode mode, CartDOF... directions) {
            this.mode = mode;
            this.chosen = indices(directions);
        }

        public CartImpBuilder setStiffness(double value) {
            for (int i : chosen) {
                within("stiffness", value, 0.0, i < 3 ? STIFFEST : STIFFEST_ROTATION);
            }
            return fill(mode.stiffness, value);
        }

        public CartImpBuilder setDamping(double value) {
            return fill(mode.damping, within("damping", value, LEAST_DAMPING, 1.0));
        }

        public CartImpBuilder setAdditionalControlForce(double value) {
            return fill(mode.additionalControlForce, finite("additionalControlForce", value));
        }

        CartImpBuilder fill(double[] into, double value) {
            for (int i : chosen) {
                into[i] = value;
            }
            return this;
        }
    }

    static int[] indices(CartDOF... directions) {
        if (directions.length == 0) {
            throw new IllegalArgumentException("parametrize needs at least one direction");
        }
        List<Integer> found = new ArrayList<>();
        for (CartDOF direction : directions) {
            int first = direction == CartDOF.ROT ? 3 : direction.ordinal() < DIRECTIONS ? direction.ordinal() : 0;
            int count = direction == CartDOF.ALL ? DIRECTIONS : direction.ordinal() < DIRECTIONS ? 1 : 3;
            for (int i = first; i < first + count; i++) {
                found.add(i);
            }
        }
        return found.stream().mapToInt(Integer::intValue).toArray();
    }

    static double[] filled(double value) {
        double[] values = new double[DIRECTIONS];
        Arrays.fill(values, value);
        return values;
    }

    static double within(String name, double value, double low, double high) {
        if (!(value >= low && value <= high)) {
            throw new IllegalArgumentException(name + " must be in [" + low + ", " + high + "], got " + value);
        }
        return value;
    }

    static double notNegative(String name, double value) {
        return within(name, value, 0.0, Double.MAX_VALUE);
    }

    static double finite(String name, double value) {
        return within(name, value, -Double.MAX_VALUE, Double.MAX_VALUE);
    }

    private static double[] limits(String name, boolean zero, double... values) {
        for (double value : values) {
            notNegative(name, value);
            if (value == 0.0 && !zero) {
                throw new IllegalArgumentException(name + " must be positive, got 0");
            }
        }
        return values;
    }

    public CartImpBuilder parametrize(CartDOF... directions) {
        return new CartImpBuilder(this, directions);
    }

    public CartesianImpedanceControlMode setNullSpaceStiffness(double value) {
        nullSpaceStiffness = notNegative("nullSpaceStiffness", value);
        return this;
    }

    public CartesianImpedanceControlMode setNullSpaceStiffnessToDefaultValue() {
        return setNullSpaceStiffness(DEFAULT_NULL_SPACE_STIFFNESS);
    }

    public CartesianImpedanceControlMode setNullSpaceDampingToDefaultValue() {
        return setNullSpaceDamping(DEFAULT_DAMPING);
    }

    public CartesianImpedanceControlMode setAdditionalControlForceToDefaultValue() {
        Arrays.fill(additionalControlForce, 0.0);
        return this;
    }

    public CartesianImpedanceControlMode setStiffnessToDefaultValue() {
        System.arraycopy(DEFAULT_STIFFNESS, 0, stiffness, 0, DIRECTIONS);
        return this;
    }

    public CartesianImpedanceControlMode setNullSpaceDamping(double value) {
        nullSpaceDamping = within("nullSpaceDamping", value, LEAST_NULL_SPACE_DAMPING, 1.0);
        return this;
    }

    /** A larger deviation from the set-point ends the motion [mm, rad]. */
    public CartesianImpedanceControlMode setMaxPathDeviation(double x, double y, double z, double a, double b, double c) {
        maxPathDeviation = limits("maxPathDeviation", false, x, y, z, a, b, c);
        return this;
    }

    /** A higher velocity ends the motion [mm/s, rad/s]. */
    public CartesianImpedanceControlMode setMaxCartesianVelocity(double x, double y, double z, double a, double b, double c) {
        maxCartesianVelocity = limits("maxCartesianVelocity", false, x, y, z, a, b, c);
        return this;
    }

    /** Limit of the force of the controller [N, Nm]; with the flag, reaching it ends the motion. */
    public CartesianImpedanceControlMode setMaxControlForce(double x, double y, double z, double a, double b, double c,
            boolean addStopCondition) {
        maxControlForce = limits("maxControlForce", true, x, y, z, a, b, c);
        stopsAtMaxControlForce = addStopCondition;
        return this;
    }

    public CartesianImpedanceControlMode setAdditionalControlForce(double x, double y, double z, double a, double b, double c) {
        double[] values = {x, y, z, a, b, c};
        for (int i = 0; i < DIRECTIONS; i++) {
            additionalControlForce[i] = finite("additionalControlForce", values[i]);
        }
        return this;
    }

    /** Frame of the directions; default: the motion frame. */
    public CartesianImpedanceControlMode setReferenceSystem(AbstractFrame frame) {
        referenceSystem = frame;
        return this;
    }

    public double[] getStiffness() {
        return stiffness.clone();
    }

    public double[] getDamping() {
        return damping.clone();
    }

    /** Not simulated: the unit and the effect are not documented. */
    public CartesianImpedanceControlMode setMaxJointSpeed(double... speeds) {
        throw new NotModelled("a largest joint speed of Cartesian impedance");
    }

    public CartesianImpedanceControlMode setDampingToDefaultValue() {
        Arrays.fill(damping, DEFAULT_DAMPING);
        return this;
    }

    public double[] getMaxPathDeviation() {
        return maxPathDeviation.clone();
    }

    public double[] getMaxCartesianVelocity() {
        return maxCartesianVelocity.clone();
    }

    public double[] getMaxControlForce() {
        return maxControlForce.clone();
    }

    public boolean hasMaxControlForceStopCondition() {
        return stopsAtMaxControlForce;
    }

    public double getNullSpaceStiffness() {
        return nullSpaceStiffness;
    }

    public double getNullSpaceDamping() {
        return nullSpaceDamping;
    }

    @Override
    public ImpedanceMode forPlant(ObjectFrame motionFrame, LBR robot) {
        return spring(motionFrame, robot);
    }

    /** Spring and damper in the plant's terms. */
    final CartesianImpedance spring(ObjectFrame motionFrame, LBR robot) {
        CartesianImpedance spring = new CartesianImpedance();
        spring.stiffness = ControlModeTranslator.directions(stiffness);
        spring.damping = ControlModeTranslator.directions(damping);
        spring.nullspaceStiffness = Math.min(nullSpaceStiffness, PLANT_NULL_SPACE_STIFFNESS);
        spring.nullspaceDamping = nullSpaceDamping;
        spring.additionalForce = ControlModeTranslator.directions(additionalControlForce);
        spring.maxForce = ControlModeTranslator.forceLimits(maxControlForce);
        spring.maxForceStops = stopsAtMaxControlForce;
        spring.maxVelocity = ControlModeTranslator.motionLimits(maxCartesianVelocity);
        spring.maxDeviation = ControlModeTranslator.motionLimits(maxPathDeviation);
        if (referenceSystem != null && referenceSystem != motionFrame) {
            spring.axes = MotionTranslator.axes(referenceSystem, robot.getRootFrame());
        }
        return spring;
    }

    @Override
    public String toString() {
        return getClass().getSimpleName() + ", stiffness " + Arrays.toString(stiffness) + ", damping " + Arrays.toString(damping);
    }
}
