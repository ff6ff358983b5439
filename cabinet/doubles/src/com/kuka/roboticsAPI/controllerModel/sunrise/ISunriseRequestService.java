package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.IRequestService;
import com.kuka.roboticsAPI.controllerModel.sunrise.api.SSR;
import com.kuka.roboticsAPI.controllerModel.sunrise.connectionLib.Message;

/** Low-level requests; those of position and torque referencing are simulated. */
public interface ISunriseRequestService extends IRequestService {
    /** Sends a request and waits for the answer, whose parameter 0 is 1 on success. */
    Message sendSynchronousSSR(SSR request);
}
