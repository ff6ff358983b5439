package heptarm.doubles;

import java.util.Arrays;

/** One motion for the plant, in SI. NaN and null stand for "the default". */
public final class MotionOrder {
    public final long id;
    public final String kind;
    /** Target of a ptp [rad]; null: the pose is the target. */
    public double[] joints;
    /** Target of the moved frame in the base: x y z [m], quaternion x y z w. */
    public double[] pose;
    /** E1 [rad], status, turn; NaN and -1 mean "keep". */
    public double[] redundancy = {Double.NaN, -1, -1};
    /** Of a circ: the auxiliary point, as the pose. */
    public double[] via;
    /**
     * How the orientation is led: variable, constant, ignored or by the joints; relative to the base or the
     * path; -1: the usual.
     */
    public int[] orientation = {-1, -1};
    /** Where it may turn into its follower: fraction of the path, [m], [rad]. */
    public double[] blending = missing(3);
    /** Motions of a batch, segments of a spline. */
    public MotionOrder[] parts = {};
    /** Flange to moved frame. */
    public double[] tcp = {0, 0, 0, 0, 0, 0, 1};
    /** Of a relative motion: translation and rotation in the axes of the reference. */
    public double[] offset;
    /** Quaternion of the reference's axes in the base; null: the moved frame's own, of a straight servo motion the base's. */
    public double[] reference;
    /** Fractions of each axis' maximum: velocity, acceleration, jerk; seven each. */
    public double[] relative = missing(21);
    /** Velocity, acceleration, jerk [m/s ...], then those of the orientation [rad/s ...]. */
    public double[] cartesian = missing(6);
    /** Of a hold [s]; NaN: until cancelled. */
    public double duration = Double.NaN;
    /**
     * Control mode; null: position; 1 and stiffness, damping, seven each: joint impedance. 2: Cartesian impedance, directions
     * x y z, then about x y z: stiffness, damping, null space's stiffness and damping, additional force, largest force, 1 if
     * that stops, largest velocity, largest deviation (NaN: no limit), quaternion of the axes in the base (NaN: the moved
     * frame's). 3: the same and a pattern: amplitude, frequency, phase, bias, force limit, position limit, then total, rise,
     * hold and fall time, 1 if the motion waits for its end.
     */
    public double[] mode;
    /** Of a servo motion: shortest trajectory, time-out after the goal, time-out of its speed [s]. */
    public double[] timing = {0.02, 30.0, 0.1};
    /** Of a straight servo motion: largest velocity x y z, about x y z, then acceleration; NaN: the usual. */
    public double[] straight;
    /**
     * Of a hand guiding: lower limits, upper limits [rad], NaN: the axis' own; joint velocity [rad/s], velocity of the moved
     * frame [m/s], NaN: unlimited; 1 if a limit freezes all axes, 1 if it pulls back.
     */
    public double[] guiding;
    /** FRI session whose client overlays the motion; 0: none. */
    public long friSession;
    /** What that client commands, as FRI numbers it. */
    public int friCommand;
    /** Break conditions, see {@link ConditionOrder}. */
    public double[][] breaks = {};
    /** Conditions of triggers. */
    public double[][] triggers = {};
    public MotionListener listener;

    public MotionOrder(long id, String kind) {
        this.id = id;
        this.kind = kind;
    }

    private static double[] missing(int count) {
        double[] numbers = new double[count];
        Arrays.fill(numbers, Double.NaN);
        return numbers;
    }
}
