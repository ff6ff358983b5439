package com.kuka.roboticsAPI.geometricModel.redundancy;

/** Base of redundancies. */
public abstract class AbstractRedundancyCollection implements IRedundancyCollection {
}
