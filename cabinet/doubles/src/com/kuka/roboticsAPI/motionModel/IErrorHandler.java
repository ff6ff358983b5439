package com.kuka.roboticsAPI.motionModel;

import java.util.List;

import com.kuka.roboticsAPI.deviceModel.Device;

/** Decides what happens after an asynchronous motion has failed. */
public interface IErrorHandler {
    ErrorHandlingAction handleError(Device device, IMotionContainer failedContainer, List<IMotionContainer> canceledContainers);
}
