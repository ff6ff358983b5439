package com.kuka.fri.api.commanding;

import heptarm.doubles2.IMotionOverlay;

/** An overlay of joint positions. */
public interface IFriJointOverlay extends IMotionOverlay {
}
