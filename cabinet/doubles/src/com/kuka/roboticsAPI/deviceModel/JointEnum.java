package com.kuka.roboticsAPI.deviceModel;

/** Joints by name. */
public enum JointEnum {
    J1, J2, J3, J4, J5, J6, J7
}
