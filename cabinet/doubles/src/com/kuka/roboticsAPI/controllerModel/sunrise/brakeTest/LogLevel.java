package com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest;

/** How grave a result is. */
public enum LogLevel {
    Info, Warning, Error
}
