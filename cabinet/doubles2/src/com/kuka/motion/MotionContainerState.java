package com.kuka.motion;

/** State of a motion; only ERROR is known by name. */
public enum MotionContainerState {
    RUNNING, ENDED, ERROR;

    public boolean isFinal() {
        return this != RUNNING;
    }
}
