package com.kuka.device;

import com.kuka.math.geometry.Vector3D;

/** A force [N] and a torque [Nm]. */
public final class ForceData {
    private final Vector3D force;
    private final Vector3D torque;

    public ForceData(Vector3D force, Vector3D torque) {
        this.force = force;
        this.torque = torque;
    }

    public Vector3D getForce() {
        return force;
    }

    public Vector3D getTorque() {
        return torque;
    }
}
