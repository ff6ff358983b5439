package com.kuka.roboticsAPI.uiModel.userKeys;

/** Size of a key's lamp. */
public enum UserKeyLEDSize {
    Small, Normal
}
