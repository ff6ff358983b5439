package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.motionModel.IMotionErrorHandler;

/** Control of the running application. */
public interface IApplicationControl {
    void registerMotionErrorHandler(IMotionErrorHandler handler);
}
