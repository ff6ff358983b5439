package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.IRequestService;
import com.kuka.roboticsAPI.controllerModel.sunrise.api.SSR;
import com.kuka.roboticsAPI.controllerModel.sunrise.connectionLib.Message;

/** Low-level requests; those of position and torque referencing are simulated. */
public interface ISunriseRequestService extends IRequestService {
    /** Sends a request and waits for its answer; its parameter 0 is 1 if that worked. */
    Message sendSynchronousSSR(SSR request);
}
