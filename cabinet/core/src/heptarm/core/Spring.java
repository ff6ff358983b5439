package heptarm.core;

import java.util.Arrays;

import heptarm.wire.CartesianImpedance;
import heptarm.wire.JointImpedance;
import heptarm.wire.SineImpedance;

/**
 * Cartesian impedance for {@link Move#mode} and servo motions, in SI; every method gives a new one. Six numbers are along x y z,
 * then about x y z; NaN: no limit.
 */
public final class Spring implements Cloneable {
    private static final int DIRECTIONS = 6;
    private static final int JOINTS = 7;
    private static final double DAMPING = 0.7;

    private double[] stiffness;
    private double[] damping = all(DIRECTIONS, DAMPING);
    private double nullStiffness = 0.0;
    private double nullDamping = DAMPING;
    private double[] force = new double[DIRECTIONS];
    private double[] mostForce = all(DIRECTIONS, Double.NaN);
    private boolean stops;
    private double[] mostVelocity = all(DIRECTIONS, Double.NaN);
    private double[] mostDeviation = all(DIRECTIONS, Double.NaN);
    private String frame = "";

    private Spring(double[] stiffness) {
        this.stiffness = stiffness;
    }

    /** Along every axis [N/m] and about every axis [Nm/rad]. */
    public static Spring of(double along, double about) {
        return new Spring(new double[] {along, along, along, about, about, about});
    }

    /** In each direction [N/m, Nm/rad]. */
    public static Spring of(double... each) {
        return new Spring(each.clone());
    }

    /** A spring in every joint [Nm/rad] with the usual damping, as a mode. */
    public static JointImpedance joints(double stiffness) {
        return new JointImpedance(all(JOINTS, stiffness), all(JOINTS, DAMPING));
    }

    /** Of the critical damping, 0.1 to 1. */
    public Spring damping(double ratio) {
        Spring copy = copy();
        copy.damping = all(DIRECTIONS, ratio);
        return copy;
    }

    /** What holds the elbow [Nm/rad], and its damping, 0.3 to 1. */
    public Spring elbow(double stiffnessOfElbow, double ratio) {
        Spring copy = copy();
        copy.nullStiffness = stiffnessOfElbow;
        copy.nullDamping = ratio;
        return copy;
    }

    /** Pushes with a force [N] and a torque [Nm] besides. */
    public Spring pushing(double... six) {
        Spring copy = copy();
        copy.force = six.clone();
        return copy;
    }

    /** Never more force [N] and torque [Nm] than this; {@code stopping}: reaching it ends the motion. */
    public Spring atMost(boolean stopping, double... six) {
        Spring copy = copy();
        copy.mostForce = six.clone();
        copy.stops = stopping;
        return copy;
    }

    /** Being faster than this [m/s, rad/s] ends the motion. */
    public Spring noFaster(double... six) {
        Spring copy = copy();
        copy.mostVelocity = six.clone();
        return copy;
    }

    /** Being farther from the path than this [m, rad] ends the motion. */
    public Spring noFarther(double... six) {
        Spring copy = copy();
        copy.mostDeviation = six.clone();
        return copy;
    }

    /** Whose axes the directions are: "base", a taught frame, or "" for the moved frame. */
    public Spring along(String axes) {
        Spring copy = copy();
        copy.frame = axes;
        return copy;
    }

    /** As a mode. */
    public CartesianImpedance mode() {
        return new CartesianImpedance(stiffness.clone(), damping.clone(), nullStiffness, nullDamping, force.clone(), mostForce.clone(),
                stops, mostVelocity.clone(), mostDeviation.clone(), frame);
    }

    /** The same with an oscillating force in each direction: amplitude [N, Nm], frequency [Hz], phase [rad]. */
    public SineImpedance swinging(double[] amplitude, double[] frequency, double[] phase) {
        double[] open = all(DIRECTIONS, Double.NaN);
        return new SineImpedance(mode(), amplitude.clone(), frequency.clone(), phase.clone(), new double[DIRECTIONS], open, open.clone(),
                Double.NaN, 0.0, Double.NaN, 0.0, false);
    }

    private Spring copy() {
        try {
            return (Spring) clone();
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
