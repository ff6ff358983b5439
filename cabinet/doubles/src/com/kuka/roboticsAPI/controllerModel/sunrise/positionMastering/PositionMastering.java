package com.kuka.roboticsAPI.controllerModel.sunrise.positionMastering;

import com.kuka.roboticsAPI.deviceModel.LBR;

/** Whether axes are mastered. */
public class PositionMastering {
    private final LBR robot;

    public PositionMastering(LBR robot) {
        this.robot = robot;
    }

    /** With a tool; mastering does not depend on it here. */
    public MasteringInfo getMasteringInfo(String tool) {
        return new MasteringInfo(this);
    }

    /** Of an axis, counted from 0. */
    public boolean isAxisMastered(int axis) {
        if (axis < 0 || axis >= robot.getJointCount()) {
            throw new IllegalArgumentException("axis must be 0 to " + (robot.getJointCount() - 1) + ", got " + axis);
        }
        return robot.isMastered();
    }
}
