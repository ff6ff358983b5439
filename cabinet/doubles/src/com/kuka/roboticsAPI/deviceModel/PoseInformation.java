package com.kuka.roboticsAPI.deviceModel;

/** How a pose was measured; only the name is known. */
public abstract class PoseInformation {
}
