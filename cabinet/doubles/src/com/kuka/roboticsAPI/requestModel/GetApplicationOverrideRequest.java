package com.kuka.roboticsAPI.requestModel;

/** Only imports of it are known; there is nothing to call. */
public interface GetApplicationOverrideRequest {
}
