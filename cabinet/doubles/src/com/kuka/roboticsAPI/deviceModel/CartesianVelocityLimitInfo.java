package com.kuka.roboticsAPI.deviceModel;

/** Limits of a device's Cartesian velocity; only the name is known, so that applications that name it compile. */
public class CartesianVelocityLimitInfo {
    protected CartesianVelocityLimitInfo() {
        throw new UnsupportedOperationException("the virtual cabinet has no limits of Cartesian velocity");
    }
}
