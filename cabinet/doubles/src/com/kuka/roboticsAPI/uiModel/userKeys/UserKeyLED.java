package com.kuka.roboticsAPI.uiModel.userKeys;

/** Colour of a key's lamp. */
public enum UserKeyLED {
    Grey, Green, Yellow, Red
}
