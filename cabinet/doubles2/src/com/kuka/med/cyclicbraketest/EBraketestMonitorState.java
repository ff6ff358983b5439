package com.kuka.med.cyclicbraketest;

/** State of the cyclic brake test. */
public enum EBraketestMonitorState {
    OK, PENDING, ERROR, FATAL
}
