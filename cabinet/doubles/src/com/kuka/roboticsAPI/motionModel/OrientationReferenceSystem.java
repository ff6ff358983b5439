package com.kuka.roboticsAPI.motionModel;

/** Reference of the orientation. */
public enum OrientationReferenceSystem {
    Base, Path
}
