package com.kuka.roboticsAPI.geometricModel.redundancy;

/** Redundancy of a robot at a pose. */
public interface IRedundancyCollection {
}
