package com.kuka.roboticsAPI.uiModel.userKeys;

/** What happened to a key; First and Second are the halves of a double key. */
public enum UserKeyEvent {
    KeyDown, KeyUp, FirstKeyDown, FirstKeyUp, SecondKeyDown, SecondKeyUp
}
