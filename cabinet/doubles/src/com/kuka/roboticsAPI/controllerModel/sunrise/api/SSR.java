package com.kuka.roboticsAPI.controllerModel.sunrise.api;

/** A low-level request. */
public final class SSR {
    private final int safetyCommand;

    SSR(int safetyCommand) {
        this.safetyCommand = safetyCommand;
    }

    /** For the simulation. */
    public int safetyCommand() {
        return safetyCommand;
    }
}
