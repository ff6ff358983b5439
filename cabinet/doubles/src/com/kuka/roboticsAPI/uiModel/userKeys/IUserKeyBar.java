package com.kuka.roboticsAPI.uiModel.userKeys;

/** Four keys beside the smartPAD's screen; they appear when the bar is published and a person selects it. */
public interface IUserKeyBar {
    IUserKey addUserKey(int slot, IUserKeyListener listener, boolean ignoreEvents);

    /** A key with an upper and a lower half. */
    IUserKey addDoubleUserKey(int slot, IUserKeyListener listener, boolean ignoreEvents);

    void publish();
}
