package com.kuka.roboticsAPI.sensorModel;

/** Accuracy of a Cartesian position; only the name is known, so that applications that name it compile. */
public class CartesianPositionInformation {
    protected CartesianPositionInformation() {
        throw new UnsupportedOperationException("the virtual cabinet has no accuracy of Cartesian positions");
    }
}
