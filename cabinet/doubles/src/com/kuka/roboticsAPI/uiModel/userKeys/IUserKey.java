package com.kuka.roboticsAPI.uiModel.userKeys;

/** One key of a bar. */
public interface IUserKey {
    void setText(UserKeyAlignment alignment, String text);

    void setLED(UserKeyAlignment alignment, UserKeyLED led, UserKeyLEDSize size);

    void setEnabled(boolean enabled);

    int getSlot();
}
