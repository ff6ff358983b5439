package com.kuka.roboticsAPI.deviceModel;

/** Joints by name; an LBR has the first seven. */
public enum JointEnum {
    J1, J2, J3, J4, J5, J6, J7, J8, J9, J10, J11, J12
}
