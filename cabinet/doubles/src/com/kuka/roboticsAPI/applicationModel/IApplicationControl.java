package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.motionModel.IErrorHandler;

/** Control of the running application. */
public interface IApplicationControl {
    void registerMoveAsyncErrorHandler(IErrorHandler handler);

    double getApplicationOverride();

    void setApplicationOverride(double value);

    /** Limits the application override to this. */
    void clipApplicationOverride(double most);

    /** Limits the override of the smartPAD to this. */
    void clipManualOverride(double most);

    /** Pauses all motions on their path. */
    void pause();

    /** Stops all motions on their path; assumed to be the same as a pause. */
    void halt();
}
