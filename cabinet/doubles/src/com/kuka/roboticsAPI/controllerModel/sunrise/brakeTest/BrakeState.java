package com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest;

/** Result of a brake test. */
public enum BrakeState {
    Holds(LogLevel.Info), Slips(LogLevel.Error), NotTested(LogLevel.Warning);

    private final LogLevel level;

    BrakeState(LogLevel level) {
        this.level = level;
    }

    public LogLevel getLogLevel() {
        return level;
    }
}
