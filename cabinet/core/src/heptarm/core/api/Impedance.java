package heptarm.core.api;

import java.util.Arrays;

import heptarm.wire.CartesianImpedance;
import heptarm.wire.JointImpedance;
import heptarm.wire.SineImpedance;

/**
 * Builds impedance control modes for {@link Move#mode} and servo motions, in SI units. Immutable: every method returns a new one.
 * Six numbers are along x y z, then about x y z; NaN: no limit.
 */
public final class Impedance implements Cloneable {
    private static final int DIRECTIONS = 6;
    private static final int JOINTS = 7;
    private static final double DAMPING = 0.7;

    private double[] stiffness;
    private double[] damping = all(DIRECTIONS, DAMPING);
    private double nullStiffness = 0.0;
    private double nullDamping = DAMPING;
    private double[] force = new double[DIRECTIONS];
    private double[] maxForce = all(DIRECTIONS, Double.NaN);
    private boolean stops;
    private double[] maxVelocity = all(DIRECTIONS, Double.NaN);
    private double[] maxDeviation = all(DIRECTIONS, Double.NaN);
    private String frame = "";

    private Impedance(double[] stiffness) {
        this.stiffness = stiffness;
    }

    /** Cartesian impedance with a stiffness along every axis [N/m] and about every axis [Nm/rad]. */
    public static Impedance cartesian(double along, double about) {
        return new Impedance(new double[] {along, along, along, about, about, about});
    }

    /** Cartesian impedance with a stiffness in each direction [N/m, Nm/rad]. */
    public static Impedance cartesian(double... each) {
        return new Impedance(each.clone());
    }

    /** Joint impedance with a stiffness [Nm/rad] in every joint and the default damping. */
    public static JointImpedance joints(double stiffness) {
        return new JointImpedance(all(JOINTS, stiffness), all(JOINTS, DAMPING));
    }

    /** Set the damping ratio, in [0.1, 1]. */
    public Impedance damping(double ratio) {
        Impedance copy = copy();
        copy.damping = all(DIRECTIONS, ratio);
        return copy;
    }

    /** Set stiffness [Nm/rad] and damping ratio, in [0.3, 1], of the null space motion of the elbow. */
    public Impedance nullSpace(double newStiffness, double ratio) {
        Impedance copy = copy();
        copy.nullStiffness = newStiffness;
        copy.nullDamping = ratio;
        return copy;
    }

    /** Superpose a constant force [N] and torque [Nm]. */
    public Impedance additionalForce(double... six) {
        Impedance copy = copy();
        copy.force = six.clone();
        return copy;
    }

    /** Limit force [N] and torque [Nm]; {@code stopping}: reaching a limit ends the motion. */
    public Impedance maxForce(boolean stopping, double... six) {
        Impedance copy = copy();
        copy.maxForce = six.clone();
        copy.stops = stopping;
        return copy;
    }

    /** Limit the velocity [m/s, rad/s]; exceeding it ends the motion. */
    public Impedance maxVelocity(double... six) {
        Impedance copy = copy();
        copy.maxVelocity = six.clone();
        return copy;
    }

    /** Limit the deviation from the path [m, rad]; exceeding it ends the motion. */
    public Impedance maxDeviation(double... six) {
        Impedance copy = copy();
        copy.maxDeviation = six.clone();
        return copy;
    }

    /** Set the axes of the directions: "base", a taught frame, or "" for the motion frame. */
    public Impedance along(String axes) {
        Impedance copy = copy();
        copy.frame = axes;
        return copy;
    }

    /** The control mode. */
    public CartesianImpedance mode() {
        return new CartesianImpedance(stiffness.clone(), damping.clone(), nullStiffness, nullDamping, force.clone(), maxForce.clone(),
                stops, maxVelocity.clone(), maxDeviation.clone(), frame);
    }

    /** The control mode with a superposed sine force in each direction: amplitude [N, Nm], frequency [Hz], phase [rad]. */
    public SineImpedance sine(double[] amplitude, double[] frequency, double[] phase) {
        double[] open = all(DIRECTIONS, Double.NaN);
        return new SineImpedance(mode(), amplitude.clone(), frequency.clone(), phase.clone(), new double[DIRECTIONS], open, open.clone(),
                Double.NaN, 0.0, Double.NaN, 0.0, false);
    }

    private Impedance copy() {
        try {
            return (Impedance) clone();
        } catch (CloneNotSupportedException e) {
            throw new AssertionError(e);
        }
    }

    private static double[] all(int count, double value) {
        double[] result = new double[count];
        Arrays.fill(result, value);
        return result;
    }
}
