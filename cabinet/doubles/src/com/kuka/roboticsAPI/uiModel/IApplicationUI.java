package com.kuka.roboticsAPI.uiModel;

import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;

/** The smartPAD, as far as an application may use it. */
public interface IApplicationUI {
    /** Shows a dialog and waits until a button is pressed; returns its index. */
    int displayModalDialog(ApplicationDialogType type, String text, String... buttons);

    IUserKeyBar createUserKeyBar(String name);
}
