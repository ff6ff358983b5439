package com.kuka.roboticsAPI.geometricModel.math;

/** Three numbers. */
public final class Vector {
    private final double x;
    private final double y;
    private final double z;

    private Vector(double x, double y, double z) {
        this.x = x;
        this.y = y;
        this.z = z;
    }

    public static Vector of(double x, double y, double z) {
        return new Vector(x, y, z);
    }

    public double getX() {
        return x;
    }

    public double getY() {
        return y;
    }

    public double getZ() {
        return z;
    }

    @Override
    public String toString() {
        return "(" + x + ", " + y + ", " + z + ")";
    }
}
