package com.kuka.roboticsAPI.uiModel.userKeys;

/** Four keys beside the screen of the smartPAD; visible when the bar is published and selected by the operator. */
public interface IUserKeyBar {
    IUserKey addUserKey(int slot, IUserKeyListener listener, boolean ignoreEvents);

    /** A key with an upper and a lower half. */
    IUserKey addDoubleUserKey(int slot, IUserKeyListener listener, boolean ignoreEvents);

    void publish();
}
