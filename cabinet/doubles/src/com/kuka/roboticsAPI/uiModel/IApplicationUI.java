package com.kuka.roboticsAPI.uiModel;

/** Interface of an application to the smartPAD. */
public interface IApplicationUI extends ITaskUI {
    /** Shows a dialog and waits until a button is pressed; returns its index. */
    int displayModalDialog(ApplicationDialogType type, String text, String... buttons);
}
