package com.kuka.roboticsAPI.ioModel;

/** Type of an input or output. */
public enum IOTypes {
    BOOLEAN, UNSIGNED_INTEGER, INTEGER, ANALOG
}
