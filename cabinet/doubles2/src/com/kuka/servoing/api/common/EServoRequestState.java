package com.kuka.servoing.api.common;

/** Result of a request to a servo motion; only SUCCESSFUL is known by name. */
public enum EServoRequestState {
    SUCCESSFUL, REFUSED
}
