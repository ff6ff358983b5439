package com.kuka.roboticsAPI.uiModel.userKeys;

/** Position on a key. */
public enum UserKeyAlignment {
    TopLeft, TopMiddle, TopRight, MiddleLeft, Middle, MiddleRight, BottomLeft, BottomMiddle, BottomRight
}
