package com.kuka.roboticsAPI.geometricModel.math;

/** A rotation: about z, then the new y, then the new x [rad]. */
public final class Rotation {
    private final Transformation turn;

    private Rotation(Transformation turn) {
        this.turn = turn;
    }

    public static Rotation ofRad(double a, double b, double c) {
        return new Rotation(Transformation.ofRad(0, 0, 0, a, b, c));
    }

    public double getAlphaRad() {
        return turn.getAlphaRad();
    }

    public double getBetaRad() {
        return turn.getBetaRad();
    }

    public double getGammaRad() {
        return turn.getGammaRad();
    }

    MatrixRotation matrix() {
        return turn.getRotationMatrix();
    }
}
