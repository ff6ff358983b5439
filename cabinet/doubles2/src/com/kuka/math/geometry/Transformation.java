package com.kuka.math.geometry;

/** A translation [mm] and a rotation [rad]. */
public final class Transformation implements ITransformation {
    private final double[] values;

    private Transformation(double[] values) {
        this.values = values;
    }

    public static Transformation ofRad(double x, double y, double z, double a, double b, double c) {
        return new Transformation(new double[] {x, y, z, a, b, c});
    }

    public double getX() {
        return values[0];
    }

    public double getY() {
        return values[1];
    }

    public double getZ() {
        return values[2];
    }

    public double getAlphaRad() {
        return values[3];
    }

    public double getBetaRad() {
        return values[4];
    }

    public double getGammaRad() {
        return values[5];
    }
}
