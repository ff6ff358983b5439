package com.kuka.roboticsAPI.uiModel;

/** Weight of a dialog. */
public enum ApplicationDialogType {
    QUESTION, INFORMATION, WARNING, ERROR
}
