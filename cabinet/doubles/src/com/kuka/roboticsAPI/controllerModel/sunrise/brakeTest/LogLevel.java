package com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest;

/** Severity of a result. */
public enum LogLevel {
    Info, Warning, Error
}
