package com.kuka.roboticsAPI.uiModel;

import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;

/** Interface of an application to the smartPAD. */
public interface IApplicationUI {
    /** Shows a dialog and waits until a button is pressed; returns its index. */
    int displayModalDialog(ApplicationDialogType type, String text, String... buttons);

    IUserKeyBar createUserKeyBar(String name);
}
