package com.kuka.roboticsAPI.controllerModel.sunrise;

/** How execution goes on after a pause. */
public enum ResumeMode {
    OnPath, NoMotion
}
