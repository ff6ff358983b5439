package com.kuka.roboticsAPI.motionModel;

/** Interpolation of the orientation along a Cartesian path. */
public enum SplineOrientationType {
    Variable, Constant, Ignore, OriJoint
}
