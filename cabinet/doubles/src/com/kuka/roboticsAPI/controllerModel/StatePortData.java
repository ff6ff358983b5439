package com.kuka.roboticsAPI.controllerModel;

/** Data of a state port; the virtual cabinet has none. */
public class StatePortData {
}
