package com.kuka.connectivity.motionModel.smartServoLIN;

import java.util.Arrays;

import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.PlantMotion;
import heptarm.doubles.seam.ServoStraight;

/** Follows destinations on straight lines. The start frame must be the current pose of the motion frame. */
public class SmartServoLIN extends ServoMotion<SmartServoLIN> {
    private static final int AXES = 3;
    private static final double MM = 1e-3;

    private final AbstractFrame start;
    private final double[] velocity = unset();
    private final double[] acceleration = unset();
    private AbstractFrame reference;

    public SmartServoLIN(AbstractFrame start) {
        this.start = start;
    }

    private static double[] unset() {
        double[] limits = new double[2 * AXES];
        Arrays.fill(limits, Double.NaN);
        return limits;
    }

    /** Frame along whose axes the limits apply; default: the world. */
    public SmartServoLIN setReferenceFrame(AbstractFrame frame) {
        reference = frame;
        return this;
    }

    /** Along x, y, z [mm/s]. */
    public SmartServoLIN setMaxTranslationVelocity(double[] millimetresPerSecond) {
        return limit("maxTranslationVelocity", millimetresPerSecond, velocity, 0, MM);
    }

    /** Along x, y, z [mm/s²]. */
    public SmartServoLIN setMaxTranslationAcceleration(double[] millimetresPerSecondSquared) {
        return limit("maxTranslationAcceleration", millimetresPerSecondSquared, acceleration, 0, MM);
    }

    /** About x, y, z [rad/s]. */
    public SmartServoLIN setMaxOrientationVelocity(double[] radiansPerSecond) {
        return limit("maxOrientationVelocity", radiansPerSecond, velocity, AXES, 1.0);
    }

    /** About x, y, z [rad/s²]. */
    public SmartServoLIN setMaxOrientationAcceleration(double[] radiansPerSecondSquared) {
        return limit("maxOrientationAcceleration", radiansPerSecondSquared, acceleration, AXES, 1.0);
    }

    /** Has no effect: the simulated arm keeps A3, so it does not move in the null space. */
    public SmartServoLIN setMaxNullSpaceVelocity(double velocity) {
        positive("maxNullSpaceVelocity", velocity);
        return this;
    }

    /** See {@link #setMaxNullSpaceVelocity}. */
    public SmartServoLIN setMaxNullSpaceAcceleration(double acceleration) {
        positive("maxNullSpaceAcceleration", acceleration);
        return this;
    }

    private SmartServoLIN limit(String name, double[] values, double[] into, int at, double unit) {
        if (values.length != AXES) {
            throw new IllegalArgumentException(name + " must have " + AXES + " values, got " + values.length);
        }
        double[] checked = new double[AXES];
        for (int i = 0; i < AXES; i++) {
            checked[i] = positive(name, values[i]) * unit;
        }
        System.arraycopy(checked, 0, into, at, AXES);
        return this;
    }

    @Override
    public ISmartServoLINRuntime getRuntime() {
        return running(true);
    }

    @Override
    public ISmartServoLINRuntime getRuntime(boolean waitForActivation) {
        return running(waitForActivation);
    }

    public AbstractFrame getStart() {
        return start;
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        ServoStraight motion = new ServoStraight();
        motion.timing = timing();
        motion.velocity = velocity;
        motion.acceleration = acceleration;
        motion.axes = MotionTranslator.axes(reference);
        return motion;
    }
}
