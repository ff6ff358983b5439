package com.kuka.roboticsAPI.geometricModel.redundancy;

/** Base of what a pose leaves open. */
public abstract class AbstractRedundancyCollection implements IRedundancyCollection {
}
