package com.kuka.roboticsAPI.controllerModel.sunrise.api;

/** Creates low-level requests. */
public final class SSRFactory {
    private SSRFactory() {
    }

    /** A command to the safety controller; 2 starts a measurement for torque referencing. */
    public static SSR createSafetyCommandSSR(int command) {
        return new SSR(command);
    }
}
