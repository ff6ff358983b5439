package com.kuka.motion;

/** A running motion. */
public interface IMotionContainer {
    void cancel();

    boolean isFinished();

    String getErrorMessage();

    MotionContainerState getState();

    void addContainerListener(IMotionContainerListener listener);
}
