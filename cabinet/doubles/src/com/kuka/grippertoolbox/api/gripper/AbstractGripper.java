package com.kuka.grippertoolbox.api.gripper;

/** Of the option "gripper toolbox", which is not simulated. Only imports are known; it has no members. */
public abstract class AbstractGripper {
}
