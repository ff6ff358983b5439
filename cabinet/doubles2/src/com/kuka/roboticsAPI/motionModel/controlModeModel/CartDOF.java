package com.kuka.roboticsAPI.motionModel.controlModeModel;

/** Cartesian degrees of freedom. */
public enum CartDOF {
    X, Y, Z, A, B, C
}
