package com.kuka.roboticsAPI.sensorModel;

import heptarm.doubles.runtime.NotModelled;

/** Accuracy of a Cartesian position; only the name is known, so that applications that name it compile. */
public class CartesianPositionInformation {
    protected CartesianPositionInformation() {
        throw new NotModelled("accuracy of Cartesian positions");
    }
}
