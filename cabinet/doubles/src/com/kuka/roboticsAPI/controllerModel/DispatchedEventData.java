package com.kuka.roboticsAPI.controllerModel;

/** An event of a field bus; the virtual cabinet has none. */
public class DispatchedEventData {
}
