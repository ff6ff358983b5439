package com.kuka.roboticsAPI.geometricModel.math;

/** An axis. */
public enum CoordinateAxis {
    X, Y, Z
}
