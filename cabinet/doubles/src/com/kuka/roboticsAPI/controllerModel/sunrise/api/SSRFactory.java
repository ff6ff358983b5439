package com.kuka.roboticsAPI.controllerModel.sunrise.api;

/** Makes low-level requests. */
public final class SSRFactory {
    private SSRFactory() {
    }

    /** A command to the safety controller; 2 measures for torque referencing. */
    public static SSR createSafetyCommandSSR(int command) {
        return new SSR(command);
    }
}
