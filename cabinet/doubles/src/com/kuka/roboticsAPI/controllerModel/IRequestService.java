package com.kuka.roboticsAPI.controllerModel;

/** Requests to the cabinet's safety controller. */
public interface IRequestService {
}
