package com.kuka.roboticsAPI.geometricModel.math;

/** A rigid transformation: millimetres; angles about z, y, x in radians. */
public interface ITransformation {
    double getX();

    double getY();

    double getZ();

    double getAlphaRad();

    double getBetaRad();

    double getGammaRad();
}
