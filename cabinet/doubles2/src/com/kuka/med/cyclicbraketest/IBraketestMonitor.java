package com.kuka.med.cyclicbraketest;

/** The cyclic brake test. */
public interface IBraketestMonitor {
    EBraketestMonitorState getState();
}
