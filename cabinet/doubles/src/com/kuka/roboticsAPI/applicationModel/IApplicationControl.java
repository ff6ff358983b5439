package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.motionModel.IErrorHandler;

/** Control of the running application. */
public interface IApplicationControl {
    void registerMoveAsyncErrorHandler(IErrorHandler handler);

    double getApplicationOverride();

    void setApplicationOverride(double value);

    /** Lowers the application override to at most this. */
    void clipApplicationOverride(double most);

    /** Lowers the override at the smartPAD to at most this. */
    void clipManualOverride(double most);

    /** Pauses all motions on their path. */
    void pause();

    /** Stops all motions on their path; as far as is known, the same as a pause. */
    void halt();
}
