package com.kuka.roboticsAPI.uiModel.userKeys;

/** One key of a bar. */
public interface IUserKey {
    void setText(UserKeyAlignment alignment, String text);

    /** A text that the operator has to confirm before the key works; here it is shown only. */
    default void setCriticalText(String text) {
        setText(UserKeyAlignment.Middle, text);
    }

    void setLED(UserKeyAlignment alignment, UserKeyLED led, UserKeyLEDSize size);

    void setEnabled(boolean enabled);

    int getSlot();
}
