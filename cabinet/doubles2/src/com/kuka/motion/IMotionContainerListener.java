package com.kuka.motion;

/** Called on changes of a container, in a thread of the cabinet. */
public interface IMotionContainerListener {
    void onContainerStateChanged(IMotionContainer container, MotionContainerState state);

    void containerFinished(IMotionContainer container);

    void motionFinished(IMotionContainer container, IMotion motion);

    void motionStarted(IMotionContainer container, IMotion motion);
}
