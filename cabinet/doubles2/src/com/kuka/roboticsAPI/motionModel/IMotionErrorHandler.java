package com.kuka.roboticsAPI.motionModel;

import java.util.List;

import com.kuka.motion.IMotionContainer;

/** Decides what happens after a motion has failed, or the arm could not hold its position after the last one. */
public interface IMotionErrorHandler {
    ErrorHandlingAction handleExecutionError(IMotionContainer failed, List<IMotionContainer> cancelled);

    ErrorHandlingAction handleMaintainingError(IMotionContainer last, List<IMotionContainer> cancelled, String text);
}
