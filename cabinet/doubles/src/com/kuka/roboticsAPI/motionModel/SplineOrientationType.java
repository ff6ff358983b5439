package com.kuka.roboticsAPI.motionModel;

/** How the orientation is led along a path in space. */
public enum SplineOrientationType {
    Variable, Constant, Ignore, OriJoint
}
