package com.kuka.roboticsAPI.conditionModel;

/** What a point on the path is counted from. */
public enum ReferenceType {
    START, DEST
}
