package com.kuka.roboticsAPI.deviceModel;

import heptarm.doubles.runtime.NotModelled;

/** Limits of a device's Cartesian velocity; only the name is known, so that applications that name it compile. */
public class CartesianVelocityLimitInfo {
    protected CartesianVelocityLimitInfo() {
        throw new NotModelled("limits of Cartesian velocity");
    }
}
