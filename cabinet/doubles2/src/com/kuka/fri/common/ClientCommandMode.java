package com.kuka.fri.common;

/** What an FRI client commands. */
public enum ClientCommandMode {
    JOINT_POSITION
}
