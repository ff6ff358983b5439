package com.kuka.fri.api.commanding;

/** What an FRI client commands. */
public enum EClientCommandMode {
    JOINT_POSITION
}
