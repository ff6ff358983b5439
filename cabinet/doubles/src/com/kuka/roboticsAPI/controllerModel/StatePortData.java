package com.kuka.roboticsAPI.controllerModel;

/** What a state port told; the virtual cabinet has none. */
public class StatePortData {
}
