package com.kuka.roboticsAPI.geometricModel;

/** Principal moments of inertia [kg m²]. */
public final class Inertia {
    private final double x;
    private final double y;
    private final double z;

    private Inertia(double x, double y, double z) {
        this.x = x;
        this.y = y;
        this.z = z;
    }

    public static Inertia of(double x, double y, double z) {
        if (!(x >= 0 && y >= 0 && z >= 0)) {
            throw new IllegalArgumentException("moments of inertia must not be negative, got " + x + ", " + y + ", " + z + " kg m²");
        }
        return new Inertia(x, y, z);
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
}
