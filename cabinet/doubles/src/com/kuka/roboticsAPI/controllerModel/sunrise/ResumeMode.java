package com.kuka.roboticsAPI.controllerModel.sunrise;

/** How execution resumes after a pause. */
public enum ResumeMode {
    OnPath, NoMotion
}
