package com.kuka.fri.common;

/** State of an FRI session. */
public enum FRISessionState { IDLE, MONITORING_WAIT, MONITORING_READY, COMMANDING_WAIT, COMMANDING_ACTIVE }
