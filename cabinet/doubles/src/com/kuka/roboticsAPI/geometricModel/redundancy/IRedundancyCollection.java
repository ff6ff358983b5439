package com.kuka.roboticsAPI.geometricModel.redundancy;

/** What a pose leaves open of a robot's joints. */
public interface IRedundancyCollection {
}
