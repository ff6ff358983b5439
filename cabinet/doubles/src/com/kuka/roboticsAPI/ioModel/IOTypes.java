package com.kuka.roboticsAPI.ioModel;

/** What an input or output is. */
public enum IOTypes {
    BOOLEAN, UNSIGNED_INTEGER, INTEGER, ANALOG
}
