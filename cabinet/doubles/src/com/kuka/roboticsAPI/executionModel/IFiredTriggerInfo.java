package com.kuka.roboticsAPI.executionModel;

import com.kuka.roboticsAPI.deviceModel.PositionInformation;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

/** Which trigger has fired. */
public interface IFiredTriggerInfo {
    IMotionContainer getMotionContainer();

    /** Where the robot was when it fired. */
    PositionInformation getPositionInformation();
}
