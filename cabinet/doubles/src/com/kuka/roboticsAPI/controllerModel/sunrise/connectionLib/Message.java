package com.kuka.roboticsAPI.controllerModel.sunrise.connectionLib;

/** The answer to a low-level request. */
public final class Message {
    private final int[] parameters;

    /** Created by the simulation. */
    public Message(int... parameters) {
        this.parameters = parameters.clone();
    }

    public int getParamInt(int index) {
        return parameters[index];
    }
}
