package com.kuka.roboticsAPI.uiModel.userKeys;

/** Hears of a key. */
public interface IUserKeyListener {
    void onKeyEvent(IUserKey key, UserKeyEvent event);
}
