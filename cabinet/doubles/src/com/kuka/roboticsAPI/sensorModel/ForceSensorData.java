package com.kuka.roboticsAPI.sensorModel;

import com.kuka.roboticsAPI.geometricModel.math.Vector;

/** Estimated external force [N] and torque [Nm] acting on the robot, and their inaccuracies. */
public final class ForceSensorData {
    private final Vector force;
    private final Vector torque;
    private final Vector forceInaccuracy;
    private final Vector torqueInaccuracy;

    public ForceSensorData(Vector force, Vector torque, Vector forceInaccuracy, Vector torqueInaccuracy) {
        this.force = force;
        this.torque = torque;
        this.forceInaccuracy = forceInaccuracy;
        this.torqueInaccuracy = torqueInaccuracy;
    }

    public Vector getForce() {
        return force;
    }

    public Vector getTorque() {
        return torque;
    }

    public Vector getForceInaccuracy() {
        return forceInaccuracy;
    }

    public Vector getTorqueInaccuracy() {
        return torqueInaccuracy;
    }

    public boolean isForceValid(double tolerance) {
        return within(forceInaccuracy, tolerance);
    }

    public boolean isTorqueValid(double tolerance) {
        return within(torqueInaccuracy, tolerance);
    }

    private static boolean within(Vector inaccuracy, double tolerance) {
        return Math.abs(inaccuracy.getX()) <= tolerance && Math.abs(inaccuracy.getY()) <= tolerance
                && Math.abs(inaccuracy.getZ()) <= tolerance;
    }
}
