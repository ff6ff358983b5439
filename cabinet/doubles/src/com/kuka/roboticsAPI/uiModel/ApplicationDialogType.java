package com.kuka.roboticsAPI.uiModel;

/** Severity of a dialog. */
public enum ApplicationDialogType {
    QUESTION, INFORMATION, WARNING, ERROR
}
