package com.kuka.roboticsAPI.motionModel;

/** What the orientation is led relative to. */
public enum OrientationReferenceSystem {
    Base, Path
}
