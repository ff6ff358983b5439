package com.kuka.grippertoolbox.api.gripper;

/** Of the option "gripper toolbox", which is not simulated; only imports of it are known, there is nothing to call. */
public abstract class AbstractGripper {
}
