package com.kuka.roboticsAPI.geometricModel;

/** A plane of two axes. */
public enum CartPlane {
    XY, XZ, YZ
}
