package com.kuka.roboticsAPI.geometricModel;

/** Cartesian degrees of freedom: along the axes, about z (A), y (B) and x (C), and several at once. */
public enum CartDOF {
    X, Y, Z, A, B, C, TRANSL, ROT, ALL
}
