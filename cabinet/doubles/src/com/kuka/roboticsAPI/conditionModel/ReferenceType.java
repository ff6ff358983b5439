package com.kuka.roboticsAPI.conditionModel;

/** Reference of a point on the path. */
public enum ReferenceType {
    START, DEST
}
