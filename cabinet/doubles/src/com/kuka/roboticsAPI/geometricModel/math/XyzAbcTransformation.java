package com.kuka.roboticsAPI.geometricModel.math;

/** A transformation of six numbers: x, y, z [mm] and angles about z, y, x [rad], kept as given. */
public final class XyzAbcTransformation implements ITransformation {
    private final double[] numbers;

    private XyzAbcTransformation(double... numbers) {
        this.numbers = numbers;
    }

    public static XyzAbcTransformation ofTranslation(double x, double y, double z) {
        return new XyzAbcTransformation(x, y, z, 0, 0, 0);
    }

    public static XyzAbcTransformation ofRad(double x, double y, double z, double a, double b, double c) {
        return new XyzAbcTransformation(x, y, z, a, b, c);
    }

    @Override
    public double getX() {
        return numbers[0];
    }

    @Override
    public double getY() {
        return numbers[1];
    }

    @Override
    public double getZ() {
        return numbers[2];
    }

    @Override
    public double getAlphaRad() {
        return numbers[3];
    }

    @Override
    public double getBetaRad() {
        return numbers[4];
    }

    @Override
    public double getGammaRad() {
        return numbers[5];
    }

    @Override
    public String toString() {
        return Transformation.of(this).toString();
    }
}
