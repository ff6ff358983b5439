package com.kuka.roboticsAPI.requestModel;

/** Only imports are known; it has no members. */
public interface GetApplicationOverrideRequest {
}
