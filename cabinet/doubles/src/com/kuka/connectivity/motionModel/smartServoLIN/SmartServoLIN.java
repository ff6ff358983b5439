package com.kuka.connectivity.motionModel.smartServoLIN;

import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.seam.MotionKind;
import heptarm.doubles.seam.MotionOrder;
import heptarm.doubles.seam.StraightLimits;

/** Follows destinations on straight lines. The start frame must be the current pose of the motion frame. */
public class SmartServoLIN extends ServoMotion<SmartServoLIN> {
    private static final int AXES = 3;
    private static final double MM = 1e-3;

    private final AbstractFrame start;
    private final StraightLimits limits = new StraightLimits();
    private AbstractFrame reference;

    public SmartServoLIN(AbstractFrame start) {
        this.start = start;
    }

    /** Frame along whose axes the limits apply; default: the world. */
    public SmartServoLIN setReferenceFrame(AbstractFrame frame) {
        reference = frame;
        return this;
    }

    /** Along x, y, z [mm/s]. */
    public SmartServoLIN setMaxTranslationVelocity(double[] millimetresPerSecond) {
        return limit("maxTranslationVelocity", millimetresPerSecond, limits.velocity, 0, MM);
    }

    /** Along x, y, z [mm/s²]. */
    public SmartServoLIN setMaxTranslationAcceleration(double[] millimetresPerSecondSquared) {
        return limit("maxTranslationAcceleration", millimetresPerSecondSquared, limits.acceleration, 0, MM);
    }

    /** About x, y, z [rad/s]. */
    public SmartServoLIN setMaxOrientationVelocity(double[] radiansPerSecond) {
        return limit("maxOrientationVelocity", radiansPerSecond, limits.velocity, AXES, 1.0);
    }

    /** About x, y, z [rad/s²]. */
    public SmartServoLIN setMaxOrientationAcceleration(double[] radiansPerSecondSquared) {
        return limit("maxOrientationAcceleration", radiansPerSecondSquared, limits.acceleration, AXES, 1.0);
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
    public void describe(MotionOrder order, ObjectFrame motionFrame, LBR robot) {
        super.describe(order, motionFrame, robot);
        order.kind = MotionKind.STRAIGHT;
        order.straightLimits = limits;
        order.reference = MotionTranslator.axes(reference);
    }
}
