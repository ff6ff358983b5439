package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.motionModel.IErrorHandler;

/** Control of the running application. */
public interface IApplicationControl {
    void registerMoveAsyncErrorHandler(IErrorHandler handler);

    double getApplicationOverride();

    void setApplicationOverride(double value);
}
