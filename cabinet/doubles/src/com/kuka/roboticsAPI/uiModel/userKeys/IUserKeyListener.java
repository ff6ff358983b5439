package com.kuka.roboticsAPI.uiModel.userKeys;

/** Called on events of a key. */
public interface IUserKeyListener {
    void onKeyEvent(IUserKey key, UserKeyEvent event);
}
